// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/exposure.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::rendering {

namespace {

/// Part of the way only, to swing over no bright car: after 0.1 s this share of it is left, after
/// 0.2 s its square.
double part_of_way(double rate_hz) {
  constexpr double kLeft = 0.65;
  constexpr double kLeftAfter_hz = 10.0;
  return 1.0 - std::pow(kLeft, kLeftAfter_hz / rate_hz);
}

}  // namespace

ExposureControl::ExposureControl(const CameraSpec& spec)
    : min_s_(spec.min_exposure_s),
      longest_s_(spec.max_exposure_s),
      max_s_(spec.max_exposure_s * spec.max_gain),
      target_(spec.target_level),
      part_(part_of_way(spec.rate_hz)),
      total_s_(spec.min_exposure_s) {}

double ExposureControl::exposure_s() const { return std::min(total_s_, longest_s_); }

double ExposureControl::gain() const { return std::max(total_s_ / longest_s_, 1.0); }

void ExposureControl::observe(double level) {
  constexpr double kGamma = 2.2;  // levels grow with the 1/2.2th power of light
  constexpr double kDarkest = 0.02;
  const double ratio = std::pow(target_ / std::max(level, kDarkest), kGamma * part_);
  total_s_ = std::clamp(total_s_ * ratio, min_s_, max_s_);
}

}  // namespace topoloc::rendering
