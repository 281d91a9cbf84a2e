// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"

#include <cstdint>
#include <span>
#include <type_traits>

#include <Eigen/Core>

namespace topoloc::map {

/// A feature of a map node as a builder makes it; quantised into a FeatureRecord when written.
struct Feature {
  Eigen::Vector2f pixel_px = Eigen::Vector2f::Zero();  ///< in the map's undistorted camera
  float depth_m = 0.0F;      ///< Z along the optical axis; 0: not lifted to 3D
  float depth_std_m = 0.0F;  ///< standard deviation of depth_m; 0 where not lifted
  float score = 0.0F;        ///< detector's score; stored clamped to [0, 1]
};

/// A feature as it lies in the map file: 12 bytes, little-endian, read in place.
struct FeatureRecord {
  static constexpr float kPixelStep_px = 1.0F / 32.0F;

  std::uint16_t u = 0;   ///< column in kPixelStep_px
  std::uint16_t v = 0;   ///< row in kPixelStep_px
  float depth_m = 0.0F;  ///< Z along the optical axis; 0: not lifted
  std::uint8_t score_code = 0;
  std::uint8_t depth_std_code = 0;
  std::uint16_t reserved = 0;  ///< written as zero

  /// Rounds to the nearest record. The caller has checked that the feature lies in the image.
  static FeatureRecord from(const Feature& feature);

  [[nodiscard]] Eigen::Vector2f pixel_px() const {
    return {static_cast<float>(u) * kPixelStep_px, static_cast<float>(v) * kPixelStep_px};
  }
  [[nodiscard]] bool lifted() const { return depth_m > 0.0F; }
  [[nodiscard]] float depth_std_m() const { return decode_depth_std_m(depth_std_code); }
  [[nodiscard]] float score() const { return decode_score(score_code); }

  /// 3D point in the node's camera frame (only where lifted()).
  [[nodiscard]] Eigen::Vector3d point_cam(const PinholeCamera& camera) const {
    return static_cast<double>(depth_m) * camera.ray(pixel_px().cast<double>());
  }

  /// Score code c stands for (c / 255)^2: small scores keep their digits, error below 0.004.
  static std::uint8_t encode_score(float score);
  static float decode_score(std::uint8_t code);

  /// Depth deviation code 0 stands for 0 m, c >= 1 for 1 mm * 2^((c - 1) / 16): 1 mm to 60 m,
  /// relative error below 2.3 %. Values between 0 and 1 mm become 1 mm, above 60 m 60 m.
  static std::uint8_t encode_depth_std(float depth_std_m);
  static float decode_depth_std_m(std::uint8_t code);
};
static_assert(sizeof(FeatureRecord) == 12 && std::is_trivially_copyable_v<FeatureRecord>);

/// Quantises L2-normalised descriptors: round(127 x), clamped to [-127, 127]. Spans of equal size.
void encode_descriptors(std::span<const float> values, std::span<std::int8_t> codes);

/// Inverse of encode_descriptors: x = code / 127 (not normalised again). Spans of equal size.
void decode_descriptors(std::span<const std::int8_t> codes, std::span<float> values);

}  // namespace topoloc::map
