// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/mapping/cloud_grid.hpp"
#include "topoloc/mapping/node_selection.hpp"
#include "topoloc/mapping/pose_refiner.hpp"
#include "topoloc/mapping/render.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/refinement/gradient_field.hpp"
#include "topoloc/refinement/match_registration.hpp"
#include "topoloc/refinement/odometry.hpp"
#include "topoloc/refinement/pose_graph.hpp"
#include "topoloc/refinement/registration_log.hpp"
#include "topoloc/refinement/surface_track.hpp"
#include "topoloc/refinement/view_correlation.hpp"
#include "topoloc/refinement/window_registration.hpp"

#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace topoloc::refinement {

/// Windows of views that are registered together.
struct WindowConfig {
  double view_m = 2.0;      ///< way from one correlated view to the next, a keyframe at least
  std::size_t views = 10;   ///< of a window
  std::size_t stride = 5;   ///< views from one window to the next
  int fine_passes = 2;      ///< over the whole drive at full resolution, after the first
  double fine_share = 0.4;  ///< their search deviations, as share of the first's
  /// In the last pass, one window of so many tells whether another lens fits better.
  std::size_t lens_sweep_every = 2;
};

/// Which routes look for the poses of views in the cloud.
enum class Routes {
  kCorrelation,  ///< windows of views by the agreement of gradients
  kMatches,      ///< single views by matches
  kAuto,         ///< both; where they contradict each other, the window
};

/// "correlation", "matches" or "auto"; std::invalid_argument otherwise.
Routes parse_routes(const std::string& text);

struct RefinementConfig {
  Routes routes = Routes::kCorrelation;
  mapping::FrameParity frames = mapping::FrameParity::kAll;
  double keyframe_m = 1.0;    ///< way between keyframes
  double camera_scale = 1.5;  ///< image size of refinement, in sizes of the matching camera
  double prior_std_m = 0.3;   ///< of the trajectory or the initial pose, per axis
  double prior_std_rad = std::numbers::pi / 180.0;
  double ground_std_m = 0.06;  ///< of the height above the road: suspension, cloud
  /// Ways over which errors of trajectory, attitude and cloud, and of the height above the road,
  /// stay the same: what is known on them counts as one together.
  double error_correlation_m = 20.0;
  double ground_correlation_m = 10.0;
  double min_significance = 5.5;  ///< of a registration; less may be chance
  /// The same of matches of a single view, which may agree on a wrong pose: of a spinning scanner's
  /// cloud some with 6 were 2 degrees off.
  double min_match_significance = 8.0;
  /// kAuto: so many views in a row without a significant match, and no more are matched.
  std::size_t fruitless_views = 24;
  /// Share of the stretches that must be registered; less is the wrong cloud or calibration.
  double min_registered_share = 0.4;
  /// Another lens fits better by more than so many standard errors: the calibration is wrong.
  double max_lens_significance = 2.5;
  /// Between neighbouring keyframes, median of the drive; more is the wrong calibration.
  double max_track_residual_px = 4.0;
  /// Between neighbouring keyframes, share of the points followed that lie far behind their surface
  /// and are left out; if it is most of them, it is not them that are wrong.
  double max_behind_share = 0.5;
  /// Added to each pose's covariance: what the whole drive shares, such as errors of the
  /// extrinsics and of the cloud (theta [rad], t [m]).
  Vector6 floor_std = (Vector6() << 0.003, 0.003, 0.003, 0.05, 0.05, 0.05).finished();
  double max_std_m = 0.25;  ///< a pose less certain than that (any axis) is rejected
  double max_std_rad = 0.02;
  double max_registration_away_m = 25.0;     ///< along the way; further is unsupported
  double max_registration_residual_m = 0.4;  ///< a pose that its registration contradicts by more
  OdometryNoise odometry;
  WindowConfig window;
  SearchConfig search;
  GradientConfig gradients;
  CorrelationConfig correlation;
  MatchConfig match;
  TrackConfig tracks;
  SolverConfig solver;
  mapping::RenderConfig render;
  mapping::LiftConfig lift;
  std::vector<std::filesystem::path> matcher_files;  ///< behind the matcher of image pairs
  int threads = 0;  ///< 0: one per usable CPU. Does not change the result
};

/// What is known of the drive's poses beforehand: one of the two.
struct PoseKnowledge {
  std::optional<evaluation::Trajectory> trajectory;  ///< of the whole drive, disturbed
  std::optional<RigidTransform> initial_pose;        ///< at the first inertial sample
};

/// Refines the poses of a drive against the cloud: sequentially in windows, then all together.
class TrajectoryRefiner : public mapping::PoseRefiner {
 public:
  /// `matcher` may be empty where only correlation is asked for (else std::invalid_argument).
  TrajectoryRefiner(const drive::Drive& drive, PoseKnowledge knowledge, RefinementConfig config,
                    std::unique_ptr<matching::ImagePairMatcher> matcher = nullptr);

  [[nodiscard]] std::string name() const override;
  /// Of what a caller may choose; the rest are constants of the program.
  [[nodiscard]] std::string settings() const override;
  [[nodiscard]] std::vector<std::filesystem::path> files() const override {
    return config_.matcher_files;
  }
  std::vector<mapping::RefinedPose> refine(const mapping::CloudGrid& grid, drive::FrameLog& frames,
                                           const mapping::Progress& progress) override;
  /// What the last refine() tried, in its order; also after it has thrown.
  [[nodiscard]] std::span<const RegistrationAttempt> attempts() const { return attempts_; }

 private:
  const drive::Drive& drive_;
  PoseKnowledge knowledge_;
  RefinementConfig config_;
  std::unique_ptr<matching::ImagePairMatcher> matcher_;
  std::vector<RegistrationAttempt> attempts_;
};

}  // namespace topoloc::refinement
