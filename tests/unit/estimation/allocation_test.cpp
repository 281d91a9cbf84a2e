// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "support/allocation_trap.hpp"
#include "support/straight_drive.hpp"

#include <memory>

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using test::StraightDrive;
using testing::AllocationTrap;

TEST(AllocationTrap, SeesNewAndEigen) {
  if (!AllocationTrap::kAvailable) {
    GTEST_SKIP() << "this build has a malloc of its own";
  }
  const AllocationTrap trap;
  auto on_heap = std::make_unique<int>(1);
  EXPECT_EQ(trap.count(), 1U);
  Eigen::VectorXd dynamic(100);
  dynamic.setZero();
  EXPECT_EQ(trap.count(), 2U) << *on_heap << dynamic.sum();
}

// IMU, speeds, standstill, full match sets of four uncertain nodes that arrive late and out of
// order, contradicting ones, doubts and a restart.
TEST(Estimator, DoesNotAllocateAfterConstruction) {
  if (!AllocationTrap::kAvailable) {
    GTEST_SKIP() << "this build has a malloc of its own";
  }
  StraightDrive drive;
  EstimatorConfig config;
  config.models.camera = drive.camera;
  Estimator estimator(config);
  std::vector<MapMatchSet> sets(30);
  for (int k = 0; k < 30; ++k) {
    MapMatchSet& set = sets[static_cast<std::size_t>(k)];
    drive.matches(0.2 + 0.1 * k + 0.003, kMaxMatches, set, {0.0, k > 20 ? 3.0 : 0.0, 0.0});
    set.node_count = kMaxMatchedNodes;
    for (int n = 0; n < kMaxMatchedNodes; ++n) {
      MatchedNode& node = set.nodes[static_cast<std::size_t>(n)];
      node = set.nodes[0];
      node.node_id = static_cast<std::uint32_t>(4 * k + n);
      node.covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
    }
    for (int i = 0; i < set.match_count; ++i) {
      set.matches[static_cast<std::size_t>(i)].node_slot = i % kMaxMatchedNodes;
    }
  }
  std::uint64_t allocations = 0;
  Estimate estimate;
  for (int i = 0; i < 450; ++i) {
    const double t = 0.01 * i;
    const ImuSample imu = StraightDrive::imu(t);
    SpeedSample speed = drive.speed(t);
    speed.speed_mps = i > 380 ? 0.0 : speed.speed_mps;
    // Two sets every 0.2 s, up to 0.6 s late, the newer one first.
    std::array<const MapMatchSet*, 2> due{};
    std::size_t due_count = 0;
    if (i % 20 == 0 && i >= 80 && (i - 80) / 10 + 1 < 30) {
      const auto k = static_cast<std::size_t>((i - 80) / 10);
      due = {&sets[k + 1], &sets[k]};
      due_count = 2;
    }
    TickInputs inputs{.imu = {&imu, 1},
                      .speed = {&speed, 1},
                      .matches = {due.data(), due_count},
                      .initial_pose = {}};
    if (i == 0 || i == 420) {
      inputs.initial_pose = InitialPose{.time_ns = imu.time_ns, .T_world_imu = drive.pose(t)};
    }
    const AllocationTrap trap;
    estimate = estimator.tick(imu.time_ns, inputs);
    Covariance P;
    estimator.state_at(imu.time_ns - 105'000'000, P);
    allocations += trap.count();
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_GT(estimate.counters.map_accepted(), 10U);
  EXPECT_GE(estimate.counters.map_rejected(), 1U);
  EXPECT_GE(estimate.counters.doubts, 1U);
}

}  // namespace
}  // namespace topoloc::estimation
