// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/verdict.hpp"

#include "topoloc/evaluation/chi_square.hpp"
#include "topoloc/evaluation/median.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include <Eigen/LU>
#include <fmt/core.h>

namespace topoloc::refinement {
namespace {

using evaluation::median;

/// Way along the drive up to each keyframe [m].
std::vector<double> way(const std::vector<Keyframe>& keyframes) {
  std::vector<double> way_m{0.0};
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    way_m.push_back(way_m.back() + step_m(keyframes, i));
  }
  return way_m;
}

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

/// The registration that is nearest along the way, and how far.
struct NearestRegistration {
  const Registration* registration = nullptr;
  double away_m = std::numeric_limits<double>::infinity();
};

NearestRegistration nearest_registration(const PoseGraph& graph, const std::vector<double>& way_m,
                                         std::size_t keyframe) {
  NearestRegistration nearest;
  for (const Registration& registration : graph.registrations) {
    const double away_m = std::abs(way_m[registration.keyframe] - way_m[keyframe]);
    if (away_m < nearest.away_m) {
      nearest = {&registration, away_m};
    }
  }
  return nearest;
}

/// Median residual of the tracks from each keyframe and of all together [px].
struct TrackResiduals {
  std::vector<std::optional<double>> of_keyframe;
  double of_all = 0.0;
};

TrackResiduals track_residuals(const SolvedDrive& drive) {
  std::vector<std::vector<double>> from(drive.keyframes.size());
  std::vector<double> all;
  for (const TrackFactor& factor : drive.graph.tracks) {
    const std::vector<double> residuals_px =
        track_residuals_px(factor, drive.T_imu_cam, drive.camera, drive.poses);
    from[factor.from].insert(from[factor.from].end(), residuals_px.begin(), residuals_px.end());
    if (factor.to == factor.from + 1) {  // over longer ways the cloud's errors add up
      all.insert(all.end(), residuals_px.begin(), residuals_px.end());
    }
  }
  TrackResiduals result;
  for (const std::vector<double>& residuals_px : from) {
    result.of_keyframe.push_back(residuals_px.empty() ? std::nullopt
                                                      : std::optional(median(residuals_px)));
  }
  result.of_all = median(std::move(all));
  return result;
}

/// How many points were followed from one keyframe to the next, and how many of these were left
/// out: no residual tells of them.
struct FollowedCount {
  std::size_t all = 0;
  std::size_t behind = 0;

  [[nodiscard]] double share_behind() const {
    return static_cast<double>(behind) / static_cast<double>(all);
  }
};

/// From each keyframe to the next; the last is of all together.
std::vector<FollowedCount> count_followed(const SolvedDrive& drive) {
  std::vector<FollowedCount> counts(drive.keyframes.size() + 1);
  for (const TrackFactor& factor : drive.graph.tracks) {
    if (factor.to == factor.from + 1) {
      for (FollowedCount* count : {&counts[factor.from], &counts.back()}) {
        count->all += factor.tracks.size() + factor.behind;
        count->behind += factor.behind;
      }
    }
  }
  return counts;
}

/// Squared normalised distance in space that is no chance (99 %).
double contradiction_limit() {
  constexpr double kConfidence = 0.99;
  static const double kLimit = evaluation::chi_square_quantile(kConfidence, 3.0);
  return kLimit;
}

/// Far off, and farther than the registration's own uncertainty explains.
bool contradicts(const Registration& registration, const Vector6& off,
                 const RefinementConfig& config) {
  const Eigen::Vector3d t = off.tail<3>();
  const Eigen::Matrix3d C = registration.covariance.bottomRightCorner<3, 3>();
  return t.norm() > config.max_registration_residual_m &&
         t.dot(C.inverse() * t) > contradiction_limit();
}

/// A shift or turn of the whole drive that the deviations of the poses given do not explain, even
/// if all had the same error. A camera that is mounted elsewhere makes one, and nothing else shows
/// it. Of poses that have a registration near.
void check_shift(const SolvedDrive& drive, const std::vector<double>& way_m,
                 const RefinementConfig& config) {
  Vector6 sum = Vector6::Zero();
  double count = 0.0;
  for (const PriorFactor& prior : drive.graph.priors) {
    if (nearest_registration(drive.graph, way_m, prior.keyframe).away_m <=
        config.max_registration_away_m) {
      sum += motion_between(prior.T_world_imu, drive.poses[prior.keyframe]);
      count += 1.0;
    }
  }
  if (count == 0.0) {
    return;
  }
  const Eigen::Vector3d turn_rad = sum.head<3>() / count;
  const Eigen::Vector3d shift_m = sum.tail<3>() / count;
  const double std_rad = std::hypot(config.prior_std_rad, config.floor_std(0));
  const double std_m = std::hypot(config.prior_std_m, config.floor_std(3));
  if ((shift_m / std_m).squaredNorm() > contradiction_limit() ||
      (turn_rad / std_rad).squaredNorm() > contradiction_limit()) {
    throw std::runtime_error(fmt::format(
        "refinement: the poses found lie {:.2f} m and {:.1f} degrees from those given, on the "
        "average of the drive ({:.2f} m along the vehicle's x axis, {:.2f} m along y, {:.2f} m "
        "along z), and these are to be good to {:.2f} m and {:.1f} degrees (--trajectory-std-m, "
        "--trajectory-std-deg). Are the camera's extrinsics right, and are the poses given those "
        "of the IMU?",
        shift_m.norm(), degrees(turn_rad.norm()), shift_m.x(), shift_m.y(), shift_m.z(),
        config.prior_std_m, degrees(config.prior_std_rad)));
  }
}

/// Of the points followed, if most of them are left out; else nothing.
std::string complaint_of_behind(const FollowedCount& followed, const RefinementConfig& config) {
  if (followed.all == 0 || followed.share_behind() <= config.max_behind_share) {
    return "";
  }
  return fmt::format(
      "of {} points followed from image to image {} move as if they were more than {:.1f} times as "
      "far as the cloud's surfaces that they are on. Are the wheel scale and the unit of the wheel "
      "speeds right, and most surfaces no mirrors?",
      followed.all, followed.behind, config.tracks.max_times_farther);
}

/// The cloud and the drive as a whole.
void check_drive(const SolvedDrive& drive, const TrackResiduals& residuals,
                 const FollowedCount& followed, const RefinementConfig& config) {
  if (drive.stretches_tried == 0) {
    throw std::runtime_error(
        fmt::format("refinement: the drive is too short: {} frames at least a keyframe's way apart "
                    "have a pose to start from, half a window of views is needed",
                    drive.keyframes.size()));
  }
  const std::string behind = complaint_of_behind(followed, config);
  const std::size_t found = drive.stretches_registered;
  if (static_cast<double>(found) <
      config.min_registered_share * static_cast<double>(drive.stretches_tried)) {
    throw std::runtime_error(fmt::format(
        "refinement: camera images and cloud do not agree: of {} stretches of the drive only {} "
        "could be registered; the cloud has a road below {} of {} keyframes. Is the cloud of this "
        "place, in the frame of the poses given (not shifted, turned, mirrored or upside down), "
        "with usable intensities? Are the camera's calibration, its extrinsics and its time offset "
        "right, and its images not dark?{}{}",
        drive.stretches_tried, found, drive.graph.ground.size(), drive.keyframes.size(),
        behind.empty() ? "" : " And ", behind));
  }
  if (drive.lens.significance > config.max_lens_significance) {
    const LensChange& change = drive.lens.change;
    throw std::runtime_error(fmt::format(
        "refinement: camera images fit the cloud better by {:.0f} % ({:.1f} times what chance "
        "does) with {}. Are the camera's intrinsics right?",
        100.0 * (drive.lens.gain - 1.0), drive.lens.significance,
        change.radial != 0.0
            ? fmt::format("some {:+.1f} added to its radial distortion", change.radial)
            : fmt::format("some {:.2f} times the camera's focal length", change.focal)));
  }
  if (!behind.empty()) {
    throw std::runtime_error("refinement: " + behind);
  }
  if (residuals.of_all > config.max_track_residual_px) {
    throw std::runtime_error(fmt::format(
        "refinement: points followed from image to image miss where cloud and odometry put them "
        "by {:.1f} px (median; at most {:.1f} px is credible). Are the camera's intrinsics and "
        "extrinsics, its time offset and the wheel scale right?",
        residuals.of_all, config.max_track_residual_px));
  }
}

}  // namespace

std::vector<mapping::RefinedPose> judge(const SolvedDrive& drive, const RefinementConfig& config) {
  const TrackResiduals residuals = track_residuals(drive);
  const std::vector<FollowedCount> followed = count_followed(drive);
  check_drive(drive, residuals, followed.back(), config);
  const std::vector<double> way_m = way(drive.keyframes);
  check_shift(drive, way_m, config);
  const std::vector<Matrix6> P =
      covariances(drive.graph, drive.T_imu_cam, drive.camera, config.solver, drive.poses);
  std::vector<mapping::RefinedPose> result;
  for (std::size_t k = 0; k < drive.keyframes.size(); ++k) {
    const Keyframe& keyframe = drive.keyframes[k];
    mapping::RefinedPose pose;
    pose.frame = keyframe.frame;
    pose.time_ns = keyframe.time_ns;
    pose.T_world_imu = drive.poses[k];
    pose.covariance = P[k];
    pose.covariance.diagonal() += config.floor_std.cwiseAbs2();

    const auto [nearest, away_m] = nearest_registration(drive.graph, way_m, k);
    const double std_rad = std::sqrt(pose.covariance.diagonal().head<3>().maxCoeff());
    const double std_m = std::sqrt(pose.covariance.diagonal().tail<3>().maxCoeff());
    pose.figures = {
        {"pose_std_m", std_m}, {"pose_std_deg", degrees(std_rad)}, {"registration_away_m", away_m}};
    bool contradicted = false;
    if (nearest != nullptr) {
      const Vector6 off = motion_between(nearest->T_world_imu, drive.poses[nearest->keyframe]);
      contradicted = contradicts(*nearest, off, config);
      pose.figures["registration_significance"] = nearest->significance;
      pose.figures["registration_residual_m"] = off.tail<3>().norm();
    }
    if (residuals.of_keyframe[k]) {
      pose.figures["track_residual_px"] = *residuals.of_keyframe[k];
    }
    if (followed[k].all > 0) {
      pose.figures["behind"] = followed[k].share_behind();
    }
    if (keyframe.T_prior) {
      pose.figures["moved_m"] = (pose.T_world_imu.p - keyframe.T_prior->p).norm();
    }
    if (away_m > config.max_registration_away_m) {
      pose.rejected = mapping::NodeReject::kPoseUnsupported;
    } else if (std_m > config.max_std_m || std_rad > config.max_std_rad) {
      pose.rejected = mapping::NodeReject::kPoseUncertain;
    } else if (contradicted) {
      pose.rejected = mapping::NodeReject::kPoseContradicted;
    }
    result.push_back(std::move(pose));
  }
  return result;
}

}  // namespace topoloc::refinement
