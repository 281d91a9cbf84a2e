// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

namespace topoloc::so3 {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Vector3d kAxes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(),
                          Vector3d(1.0, -2.0, 0.5).normalized(),
                          Vector3d(-0.3, -0.3, -0.9).normalized()};
constexpr double kAngles_rad[] = {0.0,     1e-12, 1e-8, 0.99e-4, 1.01e-4, 1e-3,   0.99e-2,
                                  1.01e-2, 0.1,   1.0,  2.0,     3.0,     3.14159};

TEST(So3, ExpOfZeroIsIdentity) { EXPECT_EQ(exp(Vector3d::Zero()), Matrix3d::Identity()); }

TEST(So3, SkewIsTheCrossProduct) {
  const Vector3d v(1.0, 2.0, 3.0);
  const Vector3d w(-4.0, 0.5, 2.0);
  EXPECT_LT((skew(v) * w - v.cross(w)).norm(), 1e-15);
}

TEST(So3, ExpIsARotationAndLogUndoesIt) {
  for (const Vector3d& axis : kAxes) {
    for (const double angle : kAngles_rad) {
      const Vector3d phi = angle * axis;
      const Matrix3d R = exp(phi);
      EXPECT_LT((R * R.transpose() - Matrix3d::Identity()).norm(), 1e-14) << angle;
      EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
      EXPECT_LT((R * axis - axis).norm(), 1e-14) << "the axis stays where it is";
      EXPECT_LT((log(R) - phi).norm(), 1e-15 + 1e-10 * angle) << angle;
    }
  }
}

TEST(So3, ExpMatchesRodriguesByHand) {
  Matrix3d quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_LT((exp({0.0, 0.0, std::numbers::pi / 2}) - quarter_turn).norm(), 1e-15);
}

TEST(So3, LogKeepsTinyAnglesToFullRelativePrecision) {
  for (const double angle : {1e-15, 1e-10, 1e-7, 1e-5}) {
    const Vector3d phi = angle * kAxes[3];
    EXPECT_LT((log(exp(phi)) - phi).norm(), 1e-14 * angle) << angle;
  }
}

TEST(So3, LogAtAndNearPiIsARotationVectorOfThatRotation) {
  for (const Vector3d& axis : kAxes) {
    for (const double below : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
      const double angle = std::numbers::pi - below;
      const Matrix3d R = exp(angle * axis);
      const Vector3d phi = log(R);
      EXPECT_NEAR(phi.norm(), angle, 1e-9);
      EXPECT_LE(phi.norm(), std::numbers::pi + 1e-12);
      EXPECT_LT((exp(phi) - R).norm(), 1e-12) << below;  // at pi either sign of the axis will do
    }
  }
}

TEST(So3, LogBeyondPiTakesTheShortWay) {
  EXPECT_LT((log(exp(Vector3d(0.0, 0.0, 4.0))) - Vector3d(0, 0, 4.0 - 2 * std::numbers::pi)).norm(),
            1e-14);
}

TEST(So3, InverseRotationHasTheNegativeLog) {
  const Vector3d phi(0.3, -1.0, 0.7);
  EXPECT_LT((log(exp(phi).transpose()) + phi).norm(), 1e-14);
  EXPECT_LT((exp(-phi) - exp(phi).transpose()).norm(), 1e-15);
}

TEST(So3, AdjointRelation) {
  const Matrix3d R = exp({0.5, -0.2, 1.3});
  const Vector3d phi(0.1, 0.2, -0.4);
  EXPECT_LT((R * exp(phi) * R.transpose() - exp(R * phi)).norm(), 1e-14);
}

TEST(So3, RightJacobianMatchesCentralDifferences) {
  constexpr double kStep = 1e-6;
  for (const Vector3d& axis : kAxes) {
    for (const double angle : {0.0, 1e-6, 0.99e-4, 1.01e-4, 0.1, 1.0, 3.0}) {
      const Vector3d phi = angle * axis;
      Matrix3d numeric;
      for (int i = 0; i < 3; ++i) {
        const Vector3d d = kStep * Vector3d::Unit(i);
        numeric.col(i) =
            (log(exp(phi).transpose() * exp(phi + d)) - log(exp(phi).transpose() * exp(phi - d))) /
            (2.0 * kStep);
      }
      EXPECT_LT((right_jacobian(phi) - numeric).norm(), 1e-9) << angle;
    }
  }
}

TEST(So3, RightJacobianInverseMatchesCentralDifferences) {
  constexpr double kStep = 1e-6;
  for (const double angle : {0.0, 1e-6, 0.99e-2, 1.01e-2, 0.1, 1.0, 3.0}) {
    const Vector3d phi = angle * kAxes[3];
    Matrix3d numeric;
    for (int i = 0; i < 3; ++i) {
      const Vector3d d = kStep * Vector3d::Unit(i);
      numeric.col(i) = (log(exp(phi) * exp(d)) - log(exp(phi) * exp(-d))) / (2.0 * kStep);
    }
    EXPECT_LT((right_jacobian_inverse(phi) - numeric).norm(), 1e-8) << angle;
  }
}

TEST(So3, RightJacobianTimesItsInverseIsIdentity) {
  for (const Vector3d& axis : kAxes) {
    for (const double angle : kAngles_rad) {
      const Vector3d phi = angle * axis;
      EXPECT_LT((right_jacobian(phi) * right_jacobian_inverse(phi) - Matrix3d::Identity()).norm(),
                1e-12)
          << angle;
    }
  }
}

TEST(So3, LeftJacobianIsRightJacobianOfTheNegativeAndItsTranspose) {
  for (const double angle : kAngles_rad) {
    const Vector3d phi = angle * kAxes[4];
    EXPECT_EQ(left_jacobian(phi), right_jacobian(-phi));
    EXPECT_LT((left_jacobian(phi) - right_jacobian(phi).transpose()).norm(), 1e-15);
    EXPECT_LT((left_jacobian(phi) - exp(phi) * right_jacobian(phi)).norm(), 1e-12);
  }
}

TEST(So3, JacobiansAreSmoothWhereTheSeriesTakesOver) {
  for (const double at : {kSmallAngle_rad, 1e-2}) {
    const Vector3d below = at * (1.0 - 1e-9) * kAxes[3];
    const Vector3d above = at * (1.0 + 1e-9) * kAxes[3];
    EXPECT_LT((right_jacobian(below) - right_jacobian(above)).norm(), 1e-10);
    EXPECT_LT((right_jacobian_inverse(below) - right_jacobian_inverse(above)).norm(), 1e-10);
  }
}

TEST(So3, RollPitchYawTurnAboutXThenYThenZ) {
  const Vector3d rpy_rad(0.3, -0.5, 2.0);
  const Matrix3d R = from_roll_pitch_yaw(rpy_rad);
  EXPECT_LT((R - exp({0, 0, 2.0}) * exp({0, -0.5, 0}) * exp({0.3, 0, 0})).norm(), 1e-15);
  EXPECT_LT((roll_pitch_yaw(R) - rpy_rad).norm(), 1e-15);
}

TEST(So3, RenormalisedRemovesRoundingAndKeepsTheRotation) {
  const Matrix3d R = exp({0.5, -0.2, 1.3});
  const Matrix3d crept = R + 1e-8 * Matrix3d::Constant(1.0);
  const Matrix3d again = renormalised(crept);
  EXPECT_LT((again * again.transpose() - Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((again - R).norm(), 1e-7);
}

}  // namespace
}  // namespace topoloc::so3
