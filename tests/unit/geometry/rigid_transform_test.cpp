// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/rigid_transform.hpp"

#include "topoloc/geometry/so3.hpp"

#include <gtest/gtest.h>

namespace topoloc {
namespace {

using Eigen::Vector3d;

const RigidTransform kT_a_b{so3::exp({0.2, -0.4, 1.1}), {1.0, 2.0, -3.0}};
const RigidTransform kT_b_c{so3::exp({-1.2, 0.4, 0.1}), {-0.5, 4.0, 0.3}};

void expect_near(const RigidTransform& a, const RigidTransform& b, double tolerance = 1e-14) {
  EXPECT_LT((a.R - b.R).norm(), tolerance);
  EXPECT_LT((a.p - b.p).norm(), tolerance);
}

TEST(RigidTransform, InverseUndoes) {
  expect_near(kT_a_b * kT_a_b.inverse(), {});
  expect_near(kT_a_b.inverse() * kT_a_b, {});
}

TEST(RigidTransform, CompositionAppliesTheRightOneFirst) {
  const Vector3d x_c(0.7, -0.2, 5.0);
  EXPECT_LT((kT_a_b * kT_b_c * x_c - kT_a_b * (kT_b_c * x_c)).norm(), 1e-14);
}

TEST(RigidTransform, MapsTheOriginToItsTranslation) {
  EXPECT_EQ(kT_a_b * Vector3d::Zero().eval(), kT_a_b.p);
}

TEST(RigidTransform, QuaternionRoundTripAndNormalisation) {
  Eigen::Quaterniond q = kT_a_b.quaternion();
  q.coeffs() *= 3.0;
  expect_near(RigidTransform::from_quaternion(kT_a_b.p, q), kT_a_b);
}

TEST(RigidTransform, InterpolateMeetsBothEnds) {
  expect_near(interpolate(kT_a_b, kT_b_c, 0.0), kT_a_b, 1e-12);
  expect_near(interpolate(kT_a_b, kT_b_c, 1.0), kT_b_c, 1e-12);
}

TEST(RigidTransform, InterpolateTurnsAtConstantRate) {
  const RigidTransform from{so3::exp({0.0, 0.0, 0.2}), {0.0, 0.0, 0.0}};
  const RigidTransform to{so3::exp({0.0, 0.0, 1.0}), {4.0, 0.0, 8.0}};
  expect_near(interpolate(from, to, 0.25), {so3::exp({0.0, 0.0, 0.4}), {1.0, 0.0, 2.0}});
}

}  // namespace
}  // namespace topoloc
