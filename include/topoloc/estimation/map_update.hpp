// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/camera_measurement.hpp"
#include "topoloc/estimation/measurements.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace topoloc::estimation {

/// Weight of a match by its whitened residual r: 1; min(1, c/r); 1 / (1 + r^2/c^2).
enum class RobustKernel { kNone, kHuber, kCauchy };

struct MapUpdateConfig {
  int max_iterations = 10;
  double convergence_theta_rad = 1e-5;  ///< iteration stops when a step is smaller than both
  double convergence_p_m = 1e-4;
  double match_gate_chi2 = 13.8;  ///< per match, 2 degrees of freedom (0.999)
  RobustKernel kernel = RobustKernel::kCauchy;
  double kernel_width_sigma = 2.0;  ///< c above
  int min_matches = 10;             ///< fewer in the gate: no update
  /// Smaller share of matches in the gate: no update. The matcher has removed its outliers, so
  /// where many are outside it the matches contradict each other: part of the scene has moved.
  double min_gate_share = 0.7;
  double pose_gate_chi2 = 35.0;  ///< correction against prior covariance, 6 degrees of freedom
};

enum class MapVerdict {
  kAccepted,
  kTooFewMatches,       ///< fewer than min_matches in front of the camera
  kTooFewInGate,        ///< matches contradict the prediction (or each other)
  kInnovationTooLarge,  ///< the correction is not believable under the prior covariance
  kNotFinite,           ///< NaN in the input or a breakdown of the numbers
};
inline constexpr std::size_t kMapVerdictCount = 5;
const char* name(MapVerdict verdict);

/// What a caller needs to judge an update. The state is touched only if accepted.
struct MapUpdateResult {
  MapVerdict verdict = MapVerdict::kAccepted;
  int iterations = 0;
  int matches = 0;          ///< offered
  int invalid = 0;          ///< behind the camera, NaN, or naming a node that is not there
  int outside_gate = 0;     ///< failed the chi-square gate at the prior
  int inliers = 0;          ///< in the gate and with a residual below kernel_width_sigma at the end
  double rms_px = 0.0;      ///< of the inliers' residuals at the end, nodes' errors removed
  double test_ratio = 0.0;  ///< pose correction's chi-square over its gate
  /// Information about (theta, p) that the matches brought, the nodes' errors marginalised.
  PoseCovariance information = PoseCovariance::Zero();
};

/// Iterated update with the matches of one frame (L6, L8, L9; eq_k, eq_x_tilde, eq_P_).
///
/// Information form: only 6x6 systems are solved, whatever the number of matches, since a match
/// depends on (theta, p) alone. The error of each matched node's pose is common to its matches and
/// is marginalised (L' = L_xx - L_xn (L_nn + Sigma_n^-1)^-1 L_nx), so that many matches on one node
/// do not make the filter believe the node's pose. All memory is allocated by the constructor.
class MapUpdate {
 public:
  MapUpdate(const CameraModel& camera, const MapUpdateConfig& config);

  MapUpdateResult apply(const MapMatchSet& set, NominalState& x, Covariance& P);

 private:
  struct Row {  ///< one line of the Jacobian buffer
    ReprojectionLinearisation at;
    double weight;  ///< robust weight / variance
    bool in_gate;
  };
  struct Information {  ///< normal equations of (theta, p)
    PoseCovariance L;
    Eigen::Matrix<double, 6, 1> b;
  };
  struct Node {
    bool uncertain;         ///< its covariance is not zero
    PoseCovariance motion;  ///< body_motion() of the node
    PoseCovariance L;       ///< normal equations of its matches, by (omega, tau)
    Eigen::Matrix<double, 6, 1> b;
    PoseCovariance L_xn;                      ///< the same by our pose error and the node's
    Eigen::Matrix<double, 6, 1> b_n;          ///< by the node's pose error
    PoseCovariance posterior;                 ///< (L_nn + Sigma^-1)^-1
    Eigen::Matrix<double, 6, 1> error_moves;  ///< (omega, tau) of its estimated pose error
  };

  [[nodiscard]] Node& node_of(const MapMatch& match) {
    return nodes_[static_cast<std::size_t>(match.node_slot)];
  }
  void linearise(const MapMatchSet& set, const NominalState& x);
  void gate(const MapMatchSet& set, const Covariance& P, MapUpdateResult& result);
  void reweight(const MapMatchSet& set);
  Information accumulate(const MapMatchSet& set);
  void estimate_node_errors(const MapMatchSet& set, const Eigen::Matrix<double, 6, 1>& step);
  [[nodiscard]] Eigen::Vector2d residual(const MapMatchSet& set, int i) const;
  void summarise(const MapMatchSet& set, MapUpdateResult& result) const;

  CameraModel camera_;
  MapUpdateConfig config_;
  std::vector<Row> rows_;          ///< Jacobian buffer, kMaxMatches long
  PoseCovariance vehicle_motion_;  ///< at the state of the last linearise()
  std::array<Node, kMaxMatchedNodes> nodes_{};
};

}  // namespace topoloc::estimation
