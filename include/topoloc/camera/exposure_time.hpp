// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::camera {

/// Which moment of a frame a time stamp is of.
enum class StampPoint : std::uint8_t {
  kStartOfExposure,
  kEndOfFrame,  ///< its last pixel has come in
};

struct ExposureTime {
  StampPoint point = StampPoint::kStartOfExposure;
  std::int64_t exposure_ns = 0;
  /// Calibrated constant that is added: readout and transfer time, where they matter.
  std::int64_t offset_ns = 0;
};

/// When the middle of the exposure was, on the clock of `stamp_ns`.
[[nodiscard]] constexpr std::int64_t mid_exposure_ns(std::int64_t stamp_ns,
                                                     const ExposureTime& time) {
  const std::int64_t half_ns = time.exposure_ns / 2;
  return stamp_ns + (time.point == StampPoint::kStartOfExposure ? half_ns : -half_ns) +
         time.offset_ns;
}

}  // namespace topoloc::camera
