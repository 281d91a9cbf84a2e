// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"

#include <filesystem>
#include <string>

namespace topoloc::matching {

/// Removal of wrong matches (L4).
struct OutlierConfig {
  /// "paper": the mean shift of all matches against the prediction and a fixed threshold
  /// (eq_mean_pixel, eq_matching_set_2d_2d). "robust": the median instead of the mean, then a
  /// consensus pose that does not know the prediction (RANSAC over P3P). "none": all are kept.
  std::string method = "robust";
  double sigma_th_px = 15.0;  ///< "paper": matches beyond 3 sigma_th of the mean shift are removed
  /// "robust": matches beyond this many median absolute deviations (scaled to a standard deviation)
  /// of the median shift are removed before the consensus. Wide: shift depends on depth.
  double median_sigmas = 5.0;
  double consensus_px = 4.0;       ///< "robust": largest reprojection error of an inlier
  int consensus_iterations = 500;  ///< "robust": upper bound of RANSAC iterations
};

/// Guided matching: where around the predicted pixel a map point is searched.
struct GuidedConfig {
  double gate_sigmas = 3.0;   ///< radius of the gate in standard deviations of the prediction
  double min_gate_px = 12.0;  ///< no gate is smaller: a tight one only finds what it expects
  double max_gate_px =
      120.0;            ///< median gate beyond this: the prediction is no guide, match freely
  double ratio = 0.95;  ///< largest distance of best to second-best descriptor in the gate
};

/// Everything configurable in matching. The defaults are for a CPU-only vehicle PC.
struct MatchingConfig {
  std::string extractor = "xfeat";  ///< model of features, or "sift"; see docs/models.md
  /// "lighterglue" (for xfeat), "lightglue" (for the others), "mutual", "ratio" or "guided"
  std::string matcher = "lighterglue";
  int max_features = 512;  ///< per image; a model file of this size must exist
  /// Matching camera: images are undistorted into this pinhole, principal point at the centre.
  int width_px = 640;
  int height_px = 384;
  double focal_px = 450.0;
  int mask_erosion_px = 4;  ///< features keep this distance from masked pixels

  std::filesystem::path model_dir;         ///< empty: default_model_dir()
  int threads = 2;                         ///< of inference; does not change the results
  std::string execution_provider = "cpu";  ///< "cpu" or "cuda"

  int nodes_per_frame = 1;  ///< 1 to estimation::kMaxMatchedNodes
  double max_node_distance_m = 25.0;
  double max_node_heading_rad = 0.8;

  double min_similarity = 0.82;  ///< "mutual", "guided": smallest cosine of two descriptors
  double max_ratio = 0.8;        ///< "ratio": largest distance of best to second-best descriptor
  double min_match_score = 0.1;  ///< networks: smallest match probability
  int min_features = 50;         ///< fewer in the image: kTooFewFeatures
  int min_matches = 12;          ///< fewer left with a 3D point: kTooFewMatches
  double pixel_std_px = 1.0;     ///< standard deviation of a keypoint's position, per axis
  GuidedConfig guided;
  OutlierConfig outliers;
};

/// Environment variable TOPOLOC_MODELS, else share/topoloc/models of the prefix that the program is
/// installed in, else third_party/cache/models of the source tree.
std::filesystem::path default_model_dir();

/// The pinhole camera that images are undistorted into.
PinholeCamera matching_camera(const MatchingConfig& config);

/// Models are named in files' names.
inline constexpr const char* kModelNameRule = "lower-case letters, digits, '-' and '_'";
bool is_model_name(const std::string& name);

/// Throws std::invalid_argument that names the first key out of range and what is allowed.
void validate(const MatchingConfig& config);

}  // namespace topoloc::matching
