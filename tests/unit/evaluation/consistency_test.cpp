// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/consistency.hpp"

#include "topoloc/geometry/so3.hpp"

#include <fstream>
#include <random>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

constexpr std::int64_t kStep_ns = 100'000'000;
constexpr int kSteps = 4000;

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// States whose errors are drawn from `covariance`, and the truth.
struct Drawn {
  Trajectory reference;
  std::vector<StateEstimate> states;
};

Drawn draw(const Matrix6d& covariance) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const Matrix6d root = covariance.llt().matrixL();
  Drawn drawn;
  for (int i = 0; i < kSteps; ++i) {
    const RigidTransform T_true{so3::exp({0.1, 0.2, 0.01 * i}), {0.5 * i, 1.0, 2.0}};
    Vector6d unit;
    for (double& value : unit) {
      value = normal(random);
    }
    const Vector6d error = root * unit;
    StateEstimate state;
    state.time_ns = i * kStep_ns;
    state.T_world_imu = {T_true.R * so3::exp(-error.head<3>()), T_true.p - error.tail<3>()};
    state.covariance = covariance;
    drawn.reference.push_back({state.time_ns, T_true});
    drawn.states.push_back(state);
  }
  return drawn;
}

/// Correlated, and as different in its units as a real one.
Matrix6d some_covariance() {
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 1e-3, 2e-3, 3e-3, 0.05, 0.02, 0.1;
  root(3, 2) = 0.03;
  root(4, 0) = -0.01;
  return root * root.transpose();
}

TEST(Consistency, HonestCovarianceGivesNeesOfItsDegreesOfFreedom) {
  const Drawn drawn = draw(some_covariance());
  const Consistency c = consistency(drawn.reference, drawn.states, 0, kStep_ns);
  EXPECT_EQ(c.steps, static_cast<std::size_t>(kSteps));
  for (const Nees& nees : {c.attitude, c.position, c.pose}) {
    EXPECT_GT(nees.mean, nees.lower);
    EXPECT_LT(nees.mean, nees.upper);
    EXPECT_LT(nees.lower, nees.dof);
    EXPECT_GT(nees.upper, nees.dof);
    EXPECT_NEAR(nees.inside_share, 0.95, 0.015);
  }
}

TEST(Consistency, OverconfidentCovarianceIsFound) {
  Drawn drawn = draw(some_covariance());
  for (StateEstimate& state : drawn.states) {
    state.covariance.bottomRightCorner<3, 3>() /= 4.0;  // half the standard deviation
    state.covariance.topRightCorner<3, 3>() /= 2.0;
    state.covariance.bottomLeftCorner<3, 3>() /= 2.0;
  }
  const Consistency c = consistency(drawn.reference, drawn.states, 0, kStep_ns);
  EXPECT_NEAR(c.position.mean, 12.0, 0.5);
  EXPECT_GT(c.position.mean, c.position.upper);
  EXPECT_LT(c.position.inside_share, 0.7);
  EXPECT_LT(c.attitude.mean, c.attitude.upper);
}

TEST(Consistency, CountsWhatItCannotJudge) {
  Drawn drawn = draw(some_covariance());
  drawn.states[10].covariance.setZero();
  drawn.states[11].covariance(0, 0) = -1.0;
  drawn.reference.resize(kSteps - 5);
  const Consistency c = consistency(drawn.reference, drawn.states, 5 * kStep_ns, kStep_ns);
  EXPECT_EQ(c.not_positive_definite, 2u);
  EXPECT_EQ(c.outside_reference, 5u);
  EXPECT_EQ(c.steps, static_cast<std::size_t>(kSteps - 12));
}

class StatesFile : public testing::Test {
 protected:
  static std::string header() {
    std::string text = "time_ns,px,py,pz,qx,qy,qz,qw,vx,mode";
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) {
        text += ",c" + std::to_string(i) + std::to_string(j);
      }
    }
    return text + "\n";
  }
  static std::string row(const std::string& time, const std::string& px) {
    std::string text = time + "," + px + ",2,3,0,0,0,1,9,tracking";
    for (int k = 0; k < 21; ++k) {
      text += "," + std::to_string(k);
    }
    return text + "\n";
  }
  std::string error_of(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    try {
      read_states(path_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
  std::filesystem::path path_ = std::filesystem::path(testing::TempDir()) / "states_test.csv";
};

TEST_F(StatesFile, ReadsColumnsByNameAndTheUpperTriangle) {
  std::ofstream(path_) << header() << row("1000000000000000001", "1.5");
  const auto states = read_states(path_);
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].time_ns, 1000000000000000001);
  EXPECT_EQ(states[0].T_world_imu.p, Eigen::Vector3d(1.5, 2.0, 3.0));
  EXPECT_EQ(states[0].covariance(0, 5), 5.0);
  EXPECT_EQ(states[0].covariance(5, 0), 5.0);
  EXPECT_EQ(states[0].covariance(1, 1), 6.0);
  EXPECT_EQ(states[0].covariance(5, 5), 20.0);
}

TEST_F(StatesFile, RefusesBadFilesWithFileAndLine) {
  using testing::HasSubstr;
  EXPECT_THAT(error_of("time_ns,px\n1,2\n"), HasSubstr(":1: no column 'py'"));
  EXPECT_THAT(error_of(""), HasSubstr("no column"));
  EXPECT_THAT(error_of(header()), HasSubstr("no rows"));
  EXPECT_THAT(error_of(header() + row("1", "nan")), HasSubstr(":2: 'nan'"));
  EXPECT_THAT(error_of(header() + row("1", "")), HasSubstr(":2: ''"));
  EXPECT_THAT(error_of(header() + row("1", "0") + row("1", "0")), HasSubstr(":3: time"));
  EXPECT_THAT(error_of(header() + "1,2,3\n"), HasSubstr(":2: found 3 columns"));
  EXPECT_THAT(error_of(header() + std::string(20000, '1')), HasSubstr(":2: line of more than"));
}

}  // namespace
}  // namespace topoloc::evaluation
