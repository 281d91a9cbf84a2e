// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/refinement/registration.hpp"
#include "topoloc/refinement/view_correlation.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace topoloc::refinement {

/// A view as part of a window that moves as one rigid body.
struct WindowView {
  const ViewCorrelation* correlation;
  RigidTransform T_world_imu;  ///< where the vehicle is thought to have been
};

struct SearchConfig {
  /// Standard deviations of the poses searched around the start (theta [rad], t [m], vehicle axes).
  Vector6 std = (Vector6() << 0.008, 0.008, 0.0175, 0.35, 0.3, 0.3).finished();
  /// Added to the covariance found: what all pieces of a scene share (calibration, time stamps,
  /// how the window bends).
  Vector6 floor_std = (Vector6() << 0.003, 0.003, 0.002, 0.04, 0.025, 0.04).finished();
  int samples = 1500;      ///< poses tried at the coarsest level
  int starts = 4;          ///< best of them that are followed to their maximum
  std::uint64_t seed = 1;  ///< of the samples
  /// What a pose one deviation away from the start costs, in parts of the views' agreement.
  double prior_weight = 0.3;
  int threads = 1;  ///< 0: one per usable CPU. Does not change the result
};

/// Finds the rigid motion of a window of views under which camera images and cloud agree best:
/// samples and climbs coarse to fine (route b, direct). The covariance is the sandwich estimate
/// H^-1 G H^-1, with H the curvature of the agreement and G the scatter of its gradients over
/// independent pieces of the scene.
Registration register_window(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                             const RigidTransform& T_imu_cam, const PinholeCamera& camera,
                             const SearchConfig& config);

/// Another lens than the calibration's: focal length, as share of the camera's, and radial
/// distortion left in the undistorted images, times the squared radius.
struct LensChange {
  double focal = 1.0;
  double radial = 0.0;
};
/// The calibration's own lens, and those that are tried in its place.
inline constexpr std::array<LensChange, 13> kLenses{{{1.0, 0.0},
                                                     {0.88, 0.0},
                                                     {0.92, 0.0},
                                                     {0.96, 0.0},
                                                     {0.98, 0.0},
                                                     {1.02, 0.0},
                                                     {1.04, 0.0},
                                                     {1.08, 0.0},
                                                     {1.12, 0.0},
                                                     {1.0, -0.2},
                                                     {1.0, -0.1},
                                                     {1.0, 0.1},
                                                     {1.0, 0.2}}};
/// How well a lens fits.
struct LensFit {
  double agreement = 0.0;  ///< sum over the patches
  double scatter = 0.0;  ///< sum over pieces of the scene of the squared lead over kLenses.front()
};
using LensSweep = std::array<LensFit, kLenses.size()>;

/// How well each of these lenses fits a window, at the pose that fits best with it: climbed to from
/// the pose `found` by register_window. `config.std`: how far off a wrong lens may have led that
/// pose.
LensSweep sweep_lens(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                     const RigidTransform& found, const RigidTransform& T_imu_cam,
                     const PinholeCamera& camera, const SearchConfig& config);

/// What a sweep says: the lens that fits best, how much better it fits than the calibration's own
/// (ratio of agreements), and that lead over its standard error.
struct BestLens {
  LensChange change;
  double gain = 1.0;
  double significance = 0.0;
};
BestLens best_lens(const LensSweep& sweep);

}  // namespace topoloc::refinement
