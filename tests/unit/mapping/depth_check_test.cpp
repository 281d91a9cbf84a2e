// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/depth_check.hpp"

#include "support/matching_scene.hpp"

#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

const PinholeCamera kCamera = testing::test_camera();

/// The second camera is `ahead_m` further on, the point `depth_m` from the first on the ray of
/// `from_px`; the cloud has it at `cloud_m`.
DepthWitness said(const Eigen::Vector2d& from_px, double depth_m, double cloud_m, double ahead_m,
                  const Eigen::Vector2d& off_px = Eigen::Vector2d::Zero()) {
  RigidTransform T_to_from;
  T_to_from.p = {0.0, 0.0, -ahead_m};
  const Eigen::Vector2d to_px = kCamera.project(T_to_from * (depth_m * kCamera.ray(from_px)));
  return witness({from_px, cloud_m, 0.05, to_px + off_px}, T_to_from, kCamera);
}

const Eigen::Vector2d kAside_px{150.0, 120.0};

TEST(DepthWitness, ConfirmsTheDepthByWhichAPointMoves) {
  EXPECT_EQ(said(kAside_px, 12.0, 12.0, 4.0), DepthWitness::kConfirms);
  EXPECT_EQ(said(kAside_px, 12.0, 12.5, 4.0, {1.0, -1.0}), DepthWitness::kConfirms);
  EXPECT_EQ(said(kAside_px, 12.0, 12.0, -4.0), DepthWitness::kConfirms) << "backwards, too";
}

TEST(DepthWitness, ContradictsTheTraceOfAVehicleBeforeTheWall) {
  EXPECT_EQ(said({230.0, 160.0}, 41.0, 8.0, 4.0), DepthWitness::kContradicts);
  EXPECT_EQ(said(kAside_px, 41.0, 8.0, -4.0), DepthWitness::kContradicts);
}

TEST(DepthWitness, TellsNothingOfWhatTheSecondImageCannotShow) {
  EXPECT_EQ(said(kAside_px, 41.0, 8.0, 4.0), DepthWitness::kNone);
}

TEST(DepthWitness, ContradictsTheWallBehindAVehicleThatTheCloudDoesNotHave) {
  EXPECT_EQ(said(kAside_px, 9.0, 25.0, 4.0), DepthWitness::kContradicts);
}

TEST(DepthWitness, TellsNothingByAMatchBesideTheEpipolarLine) {
  const Eigen::Vector2d across_px = 12.0 * Eigen::Vector2d(-71.5, 169.5).normalized();
  EXPECT_EQ(said(kAside_px, 12.0, 12.0, 4.0, across_px), DepthWitness::kNone);
  EXPECT_EQ(said(kAside_px, 41.0, 8.0, 4.0, across_px), DepthWitness::kNone);
}

TEST(DepthWitness, TellsNothingStraightAheadNorFromWhereItStands) {
  EXPECT_EQ(said({320.0, 191.0}, 41.0, 20.0, 4.0), DepthWitness::kNone);
  EXPECT_EQ(said(kAside_px, 41.0, 8.0, 0.0), DepthWitness::kNone);
}

TEST(DepthWitness, TellsNothingOfAPointBehindTheSecondCamera) {
  EXPECT_EQ(said(kAside_px, 41.0, 3.0, 4.0), DepthWitness::kNone);
}

/// A row of features 10 px apart at one depth.
struct Row {
  std::vector<map::Feature> features;
  DepthWitnesses witnesses;

  explicit Row(const std::vector<float>& depths_m) {
    for (std::size_t i = 0; i < depths_m.size(); ++i) {
      features.push_back(
          {{100.0F + 10.0F * static_cast<float>(i), 50.0F}, depths_m[i], 0.1F, 1.0F});
    }
    witnesses = {std::vector<std::uint8_t>(depths_m.size()),
                 std::vector<std::uint8_t>(depths_m.size())};
  }
  [[nodiscard]] std::vector<std::size_t> contradicted() const {
    return contradicted_depths(features, witnesses);
  }
};

TEST(ContradictedDepths, AreNoneWithoutWitness) {
  EXPECT_TRUE(Row({8.0F, 8.0F}).contradicted().empty());
}

TEST(ContradictedDepths, TakeTheirSurfaceWithThem) {
  Row row({8.0F, 8.2F, 20.0F, 0.0F, 8.1F, 8.0F, 8.0F});
  row.witnesses.contradict[0] = 2;
  EXPECT_EQ(row.contradicted(), (std::vector<std::size_t>{0, 1, 4}))
      << "not another surface, nor what has no depth, nor what is far off";
}

TEST(ContradictedDepths, LeaveWhatAnotherNeighbourConfirms) {
  Row row({8.0F, 8.0F, 8.0F});
  row.witnesses.contradict[0] = 1;
  row.witnesses.confirm[0] = 1;
  row.witnesses.contradict[1] = 1;
  row.witnesses.confirm[2] = 1;
  EXPECT_EQ(row.contradicted(), (std::vector<std::size_t>{1}));
}

TEST(ContradictedDepths, LeaveASurfaceThatMostConfirm) {
  Row row({8.0F, 8.0F, 8.0F, 8.0F});
  row.witnesses.contradict[0] = 1;
  row.witnesses.confirm[1] = row.witnesses.confirm[2] = 1;
  EXPECT_EQ(row.contradicted(), (std::vector<std::size_t>{0}));
}

}  // namespace
}  // namespace topoloc::mapping
