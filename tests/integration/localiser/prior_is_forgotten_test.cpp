// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
//
// One map update on real frames from a prior that is wrong by 0.3 m and 1 degree, beside one from
// the true prior: what is left of the difference is what the update believes the prior. Matching in
// windows that are too small keeps half of it and looks confident. Where the two priors choose
// different nodes, the difference is that between the nodes; such frames do not count.
#include "topoloc/drive/drive.hpp"
#include "topoloc/estimation/map_update.hpp"
#include "topoloc/geometry/so3.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/matching/map_matcher.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc {
namespace {

/// Drive and map that tests/integration/prepare made; the tests are skipped without them.
std::filesystem::path prepared(const char* name) {
  const char* dir = std::getenv("TOPOLOC_TEST_DRIVES");
  return dir == nullptr ? std::filesystem::path() : std::filesystem::path(dir) / name;
}

constexpr double kMaxLeft = 0.10;           ///< of the prior's error
constexpr double kMaxShareOfFrames = 0.10;  ///< that may keep more

class PriorIsForgotten : public testing::TestWithParam<const char*> {};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double share_above(const std::vector<double>& values, double limit) {
  const auto above =
      std::count_if(values.begin(), values.end(), [limit](double value) { return value > limit; });
  return static_cast<double>(above) / static_cast<double>(values.size());
}

TEST_P(PriorIsForgotten, AtMostATenthIsLeftAfterOneUpdate) {
  if (!std::filesystem::exists(prepared("kitti_0039.tmap"))) {
    GTEST_SKIP() << "no prepared drive (set TOPOLOC_TEST_DRIVES, see tests/integration/prepare)";
  }
  drive::Drive drive = drive::load_drive(prepared("kitti_0039"));
  drive.vehicle.matching.matcher = GetParam();
  drive::FrameLog frames = drive::open_frames(drive);
  const map::MapFile map(prepared("kitti_0039.tmap"));
  const auto& camera = drive.vehicle.camera.kalibr;
  matching::MapMatcher matcher(drive.vehicle.matching, map, camera.calibration, camera.T_imu_cam,
                               {});
  estimation::MapUpdate update({matcher.camera(), camera.T_imu_cam.inverse()},
                               drive.vehicle.estimator.models.map_update);

  constexpr double kPositionStd_m = 0.3;
  constexpr double kAttitudeStd_rad = std::numbers::pi / 180.0;
  estimation::Covariance P_prior = estimation::Covariance::Identity();
  P_prior.topLeftCorner<3, 3>() *= kAttitudeStd_rad * kAttitudeStd_rad;
  P_prior.block<3, 3>(3, 3) *= kPositionStd_m * kPositionStd_m;

  std::vector<double> position_left;
  std::vector<double> attitude_left;
  int frame_number = 0;
  for (std::size_t i = 3; i < frames.size(); i += 10, ++frame_number) {
    const auto truth = evaluation::pose_at(*drive.ground_truth, frames.time_ns(i), 200'000'000);
    if (!truth) {
      continue;
    }
    const cv::Mat image = frames.grey(i);
    const auto updated = [&](const Eigen::Vector3d& dp, const Eigen::Vector3d& dtheta,
                             estimation::NominalState& x) {
      x = {};
      x.R_world_imu = truth->R * so3::exp(dtheta);
      x.p_world_imu = truth->p + dp;
      estimation::Covariance P = P_prior;
      estimation::MapMatchSet set;
      const auto report = matcher.match(
          frames.time_ns(i), image,
          {.T_world_imu = x.T_world_imu(), .covariance = P.topLeftCorner<6, 6>()}, set);
      const bool accepted = report.verdict == matching::FrameVerdict::kOk &&
                            update.apply(set, x, P).verdict == estimation::MapVerdict::kAccepted;
      return accepted ? std::optional(report.node_ids[0]) : std::nullopt;
    };
    // Ahead, left, behind and right of the truth in turn, in the vehicle's axes.
    const double angle = 0.5 * std::numbers::pi * frame_number;
    const Eigen::Vector3d dp =
        truth->R * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0) * kPositionStd_m;
    const Eigen::Vector3d dtheta(0.0, 0.0,
                                 frame_number % 2 == 0 ? kAttitudeStd_rad : -kAttitudeStd_rad);
    estimation::NominalState from_truth;
    estimation::NominalState from_wrong;
    const auto node = updated(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), from_truth);
    const auto node_of_wrong = updated(dp, dtheta, from_wrong);
    ASSERT_TRUE(node && node_of_wrong) << i;
    if (*node != *node_of_wrong) {
      continue;
    }
    position_left.push_back((from_wrong.p_world_imu - from_truth.p_world_imu).norm() /
                            kPositionStd_m);
    attitude_left.push_back(
        so3::log(from_truth.R_world_imu.transpose() * from_wrong.R_world_imu).norm() /
        kAttitudeStd_rad);
  }
  ASSERT_GE(position_left.size(), 30U);
  RecordProperty("median_position_left", std::to_string(median(position_left)));
  RecordProperty("median_attitude_left", std::to_string(median(attitude_left)));
  RecordProperty("frames_keeping_position", std::to_string(share_above(position_left, kMaxLeft)));
  RecordProperty("frames_keeping_attitude", std::to_string(share_above(attitude_left, kMaxLeft)));
  EXPECT_LE(median(position_left), kMaxLeft);
  EXPECT_LE(median(attitude_left), kMaxLeft);
  EXPECT_LE(share_above(position_left, kMaxLeft), kMaxShareOfFrames);
  EXPECT_LE(share_above(attitude_left, kMaxLeft), kMaxShareOfFrames);
}

INSTANTIATE_TEST_SUITE_P(Matchers, PriorIsForgotten,
                         testing::Values("lighterglue", "mutual", "guided"),
                         [](const auto& matcher) { return std::string(matcher.param); });

}  // namespace
}  // namespace topoloc
