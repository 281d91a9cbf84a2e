// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/survey.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/mapping/point_cloud.hpp"
#include "topoloc/simulation/drive_spec.hpp"
#include "topoloc/simulation/voxel_filter.hpp"
#include "topoloc/world/random.hpp"
#include "topoloc/world/world.hpp"

#include "support/temporary_folder.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

evaluation::Trajectory level_trajectory(double duration_s) {
  evaluation::Trajectory truth;
  for (int i = 0; i < static_cast<int>(duration_s * 10.0); ++i) {
    truth.push_back({i * 100'000'000LL, {so3::exp({0.0, 0.0, 0.01 * i}), {0.7 * i, 2.0, -1.0}}});
  }
  return truth;
}

TEST(Prior, IsWrongBy30cmAndOneDegreeSlowly) {
  const auto truth = level_trajectory(3000.0);
  const PoseError::Spec spec = drive_spec({}).prior;
  const auto prior = disturbed(truth, spec, 99);
  ASSERT_EQ(prior.size(), truth.size());
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  double fastest_mps = 0.0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(prior[i].time_ns, truth[i].time_ns);
    const Eigen::Vector3d p = prior[i].T_world_imu.p - truth[i].T_world_imu.p;
    const Eigen::Vector3d r = so3::log(truth[i].T_world_imu.R.transpose() * prior[i].T_world_imu.R);
    position += p.cwiseAbs2();
    rotation += r.cwiseAbs2();
    fastest_mps = i > 0 ? std::max(fastest_mps, (p - last).norm() / 0.1) : 0.0;
    last = p;
  }
  const auto count = static_cast<double>(truth.size());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(position[axis] / count), 0.3, 0.05) << axis;
    EXPECT_NEAR(std::sqrt(rotation[axis] / count), 0.01745, 0.003) << axis;
  }
  EXPECT_LT(fastest_mps, 0.25);
}

struct Surveyed {
  SurveyCounts counts;
  double way_m;
};

/// A survey of 150 m of highway by a scanner of few beams.
Surveyed surveyed(double limit_mps, double traffic_per_km, double turns_hz = 10.0) {
  const world::World highway = world::make_world({world::Scenario::kHighway, 3, 150.0});
  Road road = road_of(highway);
  road.speed_limit_mps = [limit_mps](double) { return limit_mps; };
  const Ego ego = drive_along(road, {}, 5);
  const world::Visit visit(highway, {2, 0.3, traffic_per_km});
  rendering::Raycaster raycaster(highway, visit.parked());
  SurveySpec spec;
  spec.lidar.beams = 16;
  spec.lidar.columns = 180;
  spec.lidar.rate_hz = turns_hz;
  const SurveyCounts counts = survey(
      raycaster, ego, visit, nominal_mounting().T_vehicle_lidar, spec, 0, 7,
      [](const SurveyPoint&) {}, [](double) {});
  return {counts, ego.along_m(ego.duration_s()) - ego.along_m(0.0)};
}

TEST(Survey, ScansOnceAMetreWhereTheScannerTurnsFastEnough) {
  const Surveyed slow = surveyed(7.0, 10.0);  // 0.7 m a turn
  EXPECT_NEAR(static_cast<double>(slow.counts.scans), slow.way_m, 2.0);
  const Surveyed fast = surveyed(7.0, 10.0, 2.0);  // 3.5 m a turn
  EXPECT_LT(static_cast<double>(fast.counts.scans), 0.5 * fast.way_m);
  EXPECT_GT(static_cast<double>(fast.counts.scans), fast.way_m / 3.6);
}

TEST(Survey, VehiclesThatDriveLeaveTraces) {
  const Surveyed busy = surveyed(10.0, 30.0);
  EXPECT_GT(busy.counts.moving_points, 100U);
  EXPECT_LT(busy.counts.moving_points, busy.counts.points / 4);
  const Surveyed lonely = surveyed(10.0, 0.0);
  EXPECT_EQ(lonely.counts.moving_points, 0U);
  EXPECT_GT(lonely.counts.points, 1000U);
}

TEST(SmoothNoise, HasItsSlope) {
  const SmoothNoise noise(5, 3.0);
  for (double at = -10.0; at < 10.0; at += 0.37) {
    EXPECT_NEAR(noise.slope(at), (noise.value(at + 1e-5) - noise.value(at - 1e-5)) / 2e-5, 1e-6);
  }
}

TEST(VoxelFilter, KeepsOnePointOfACube) {
  VoxelFilter filter(100.0);
  world::Random random(3);
  int kept = 0;
  for (int i = 0; i < 200'000; ++i) {
    const Eigen::Vector3d p(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), 0.01);
    kept += filter.keep(p, 0.05) ? 1 : 0;
  }
  EXPECT_EQ(kept, 1600);
  EXPECT_FALSE(filter.keep({0.01, 0.01, 0.01}, 0.05));
  EXPECT_TRUE(filter.keep({0.01, 0.01, 0.01}, 0.15));
}

TEST(VoxelFilter, ForgetsWhatLiesFarBehind) {
  VoxelFilter filter(100.0);
  EXPECT_TRUE(filter.keep({0.0, 0.0, 0.0}, 0.05));
  filter.advance(101.0);
  EXPECT_FALSE(filter.keep({0.0, 0.0, 0.0}, 0.05));
  filter.advance(202.0);
  EXPECT_TRUE(filter.keep({0.0, 0.0, 0.0}, 0.05));
}

std::vector<SurveyPoint> some_points() {
  std::vector<SurveyPoint> points;
  world::Random random(8);
  for (int i = 0; i < 1000; ++i) {
    points.push_back({.p_world_m = {random.uniform(-500.0, 500.0), random.uniform(-500.0, 500.0),
                                    random.uniform(-5.0, 20.0)},
                      .intensity = static_cast<float>(random.uniform()),
                      .time_ns = 1'780'000'000'000'000'000 + i});
  }
  return points;
}

template <typename Writer>
void expect_read_back(const std::filesystem::path& file, double tolerance_m) {
  const auto points = some_points();
  Writer writer(file);
  for (const SurveyPoint& point : points) {
    writer.write(point);
  }
  writer.close();
  const mapping::PointCloud cloud = mapping::load_point_cloud(file);
  ASSERT_EQ(cloud.size(), points.size());
  EXPECT_TRUE(cloud.has_intensity);
  EXPECT_EQ(cloud.rejected(), 0U);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((cloud.position_world(i) - points[i].p_world_m).norm(), tolerance_m);
    EXPECT_NEAR(cloud.intensities[i], 65535.0F * points[i].intensity, 0.51F);
  }
}

TEST(CloudFiles, LazIsReadByTheMapBuilder) {
  const topoloc::testing::TemporaryFolder folder;
  expect_read_back<LazWriter>(folder / "cloud.laz", 0.001);
}

TEST(CloudFiles, PlyIsReadByTheMapBuilder) {
  const topoloc::testing::TemporaryFolder folder;
  expect_read_back<PlyWriter>(folder / "cloud.ply", 0.001);
}

TEST(CloudFiles, NoPlaceToWriteIsAnErrorThatNamesTheFile) {
  try {
    LazWriter writer("/nowhere/cloud.laz");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/cloud.laz"), std::string::npos);
  }
}

}  // namespace
}  // namespace topoloc::simulation
