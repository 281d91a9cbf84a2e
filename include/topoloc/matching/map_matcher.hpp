// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/matching/config.hpp"
#include "topoloc/matching/predicted_camera.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include <opencv2/core.hpp>

namespace topoloc::map {
class MapFile;
}

namespace topoloc::matching {

/// Outcome of one frame.
enum class FrameVerdict {
  kOk,
  kBadImage,        ///< not CV_8UC1 of the calibrated size
  kBadPrediction,   ///< pose or covariance not finite
  kNoNodeNear,      ///< none within distance and heading
  kTooFewFeatures,  ///< dark, blurred or covered image
  kTooFewMatches,   ///< fewer than min_matches with a 3D point after outlier removal
};
inline constexpr std::size_t kFrameVerdicts = 6;
std::string_view to_string(FrameVerdict verdict);

/// How much work goes into a frame, most first: what a thread without time to spare does without.
enum class Effort : std::uint8_t {
  kFull,    ///< as configured
  kGuided,  ///< no network matches: inside the prediction's gates, freely where that fails
  kBand,    ///< the same with the middle half of the image's rows
};

/// What happened to one frame, for health, logs and tuning.
struct FrameReport {
  FrameVerdict verdict = FrameVerdict::kOk;
  int node_count = 0;
  std::array<std::uint32_t, estimation::kMaxMatchedNodes> node_ids{};
  /// Nearer than the last node used, but their block in the map file fails its checksum.
  int damaged_nodes = 0;
  int features = 0;
  bool guided = false;  ///< matched inside the prediction's gates
  int raw_matches = 0;  ///< all nodes together
  // Matches left out, by reason; raw_matches minus these is `matches`.
  int without_depth = 0;  ///< the node feature could not be lifted
  int behind_camera = 0;  ///< by the predicted pose
  int outliers = 0;
  int over_capacity = 0;  ///< beyond estimation::kMaxMatches, lowest scores
  int matches = 0;
  struct StageTimes {
    double undistort_ms = 0.0;
    double extract_ms = 0.0;
    double select_ms = 0.0;
    double match_ms = 0.0;
    double outliers_ms = 0.0;
  } times;
};

/// L2 to L5 for one frame: undistort, extract, choose nodes, match, remove outliers, and hand out
/// 2D-3D matches in world coordinates. Not thread-safe: one per thread.
class MapMatcher {
 public:
  using Prediction = PosePrediction;

  /// `map` must outlive this. `raw_mask`: CV_8UC1 in raw image coordinates, 0 = ignore; may be
  /// empty. Throws std::runtime_error where a model is missing, std::invalid_argument where the map
  /// was made with another model (says which) or the configuration is out of range.
  MapMatcher(const MatchingConfig& config, const map::MapFile& map, const CameraCalibration& camera,
             const RigidTransform& T_imu_cam, const cv::Mat& raw_mask);
  ~MapMatcher();
  MapMatcher(MapMatcher&&) noexcept;
  MapMatcher& operator=(MapMatcher&&) noexcept;

  /// `time_ns`: mid-exposure. `out` holds matches only where the verdict is kOk.
  FrameReport match(std::int64_t time_ns, const cv::Mat& raw_grey, const Prediction& prediction,
                    estimation::MapMatchSet& out, Effort effort = Effort::kFull);

  /// The least that match() can make do with: kBand needs a model for half of the rows.
  [[nodiscard]] Effort least_effort() const;

  /// Asks the kernel to read ahead the nodes that will be nearest at a pose; returns at once.
  void prefetch(const RigidTransform& T_world_imu) const;

  /// The camera that the pixels of the matches refer to.
  [[nodiscard]] const PinholeCamera& camera() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::matching
