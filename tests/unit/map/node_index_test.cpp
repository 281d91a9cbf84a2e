// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/node_index.hpp"

#include "map_fixture.hpp"
#include "support/allocation_trap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace topoloc::map::test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Camera on the ground plane looking along a heading.
RigidTransform looking(double x_m, double y_m, double heading_rad) {
  Eigen::Matrix3d R_world_cam;
  R_world_cam.col(0) = Eigen::Vector3d(std::sin(heading_rad), -std::cos(heading_rad), 0.0);
  R_world_cam.col(1) = -Eigen::Vector3d::UnitZ();
  R_world_cam.col(2) = Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  return {R_world_cam, {x_m, y_m, 1.5}};
}

class NodeIndexTest : public MapTest {
 protected:
  NodeIndex index_of(const std::vector<RigidTransform>& poses) {
    const MapInfo info = make_info();
    MapWriter writer(path(), info);
    NodeDraft node;
    for (const RigidTransform& pose : poses) {
      node.time_ns += 1;
      node.T_world_cam = pose;
      writer.add(node);
    }
    writer.finish();
    return NodeIndex(MapFile(path()));
  }
  std::vector<std::uint32_t> nearest(const NodeIndex& index, const RigidTransform& pose, int k,
                                     double max_distance_m, double max_heading_rad) {
    std::array<std::uint32_t, 64> ids{};
    const int n = index.nearest(pose, k, max_distance_m, max_heading_rad, ids);
    return {ids.begin(), ids.begin() + n};
  }
};

TEST_F(NodeIndexTest, FindsTheNearestFirst) {
  const NodeIndex index = index_of({looking(0, 0, 0), looking(5, 0, 0), looking(10, 0, 0)});
  EXPECT_EQ(nearest(index, looking(6, 0, 0), 3, 100.0, 0.5), (std::vector<std::uint32_t>{1, 2, 0}));
  EXPECT_EQ(nearest(index, looking(6, 0, 0), 2, 100.0, 0.5), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(nearest(index, looking(6, 0, 0), 3, 4.5, 0.5), (std::vector<std::uint32_t>{1, 2}));
}

TEST_F(NodeIndexTest, DistanceAndEqualityAreInclusive) {
  const NodeIndex index = index_of({looking(0, 4, 0), looking(0, -4, 0), looking(3, 4, 0)});
  EXPECT_EQ(nearest(index, looking(0, 0, 0), 1, 4.0, 0.5), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(nearest(index, looking(0, 0, 0), 3, 5.0, 0.5), (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(nearest(index, looking(0, 0, 0), 3, 3.999, 0.5), (std::vector<std::uint32_t>{}));
}

TEST_F(NodeIndexTest, ANodeSeenInTheOppositeDirectionDoesNotMatch) {
  const NodeIndex index =
      index_of({looking(0, 0, kPi), looking(1, 0, kPi), looking(8, 0, 0.3), looking(9, 0, 1.0)});
  EXPECT_EQ(nearest(index, looking(0, 0, 0), 2, 25.0, 0.8), (std::vector<std::uint32_t>{2}));
  EXPECT_EQ(nearest(index, looking(0, 0, kPi), 2, 25.0, 0.8), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(nearest(index, looking(0, 0, 0), 4, 25.0, kPi),
            (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST_F(NodeIndexTest, AgreesWithSearchingAllNodes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto pose = [&] {
    return looking(300 * unit(random), 300 * unit(random), 2 * kPi * unit(random));
  };
  std::vector<RigidTransform> poses(3000);
  std::generate(poses.begin(), poses.end(), pose);
  const NodeIndex index = index_of(poses);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    const RigidTransform query = pose();
    const double max_distance_m = 5.0 + 30.0 * unit(random);
    std::vector<std::pair<double, std::uint32_t>> all;
    for (std::uint32_t id = 0; id < poses.size(); ++id) {
      const double distance_m = (poses[id].p - query.p).norm();
      if (distance_m <= max_distance_m && poses[id].R.col(2).dot(query.R.col(2)) >= std::cos(0.8)) {
        all.emplace_back(distance_m, id);
      }
    }
    std::sort(all.begin(), all.end());
    all.resize(std::min<std::size_t>(all.size(), 4));
    std::vector<std::uint32_t> expected;
    for (const auto& [distance_m, id] : all) {
      expected.push_back(id);
    }
    ASSERT_EQ(nearest(index, query, 4, max_distance_m, 0.8), expected);
    found += static_cast<int>(expected.size());
  }
  EXPECT_GT(found, 300);
}

TEST_F(NodeIndexTest, AnswersNothingToNonsense) {
  const NodeIndex index = index_of({looking(0, 0, 0)});
  RigidTransform pose = looking(0, 0, 0);
  EXPECT_EQ(nearest(index, pose, 0, 10.0, 1.0).size(), 0U);
  EXPECT_EQ(nearest(index, pose, -3, 10.0, 1.0).size(), 0U);
  EXPECT_EQ(nearest(index, pose, 1, NAN, 1.0).size(), 0U);
  EXPECT_EQ(nearest(index, pose, 1, -1.0, 1.0).size(), 0U);
  EXPECT_EQ(nearest(index, pose, 1, 10.0, NAN).size(), 0U);
  EXPECT_EQ(index.nearest(pose, 1, 10.0, 1.0, {}), 0);
  EXPECT_EQ(nearest(index, pose, 1000, 10.0, 1.0).size(), 1U);
  pose.p.x() = NAN;
  EXPECT_EQ(nearest(index, pose, 1, 10.0, 1.0).size(), 0U);
}

TEST_F(NodeIndexTest, LookingUpDoesNotAllocate) {
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 1000; ++i) {
    poses.push_back(looking(i, 0, 0));
  }
  const NodeIndex index = index_of(poses);
  const MapFile map(path());
  std::array<std::uint32_t, 8> ids{};
  const RigidTransform query = looking(500.2, 0, 0);
  const testing::AllocationTrap trap;
  const int n = index.nearest(query, 8, 25.0, 0.8, ids);
  const NodeView node = map.node(ids[0]);
  EXPECT_EQ(trap.count(), 0U);
  EXPECT_EQ(n, 8);
  EXPECT_EQ(node.id, 500U);
}

}  // namespace
}  // namespace topoloc::map::test
