// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/imu_screen.hpp"

namespace topoloc::estimation {

bool ImuScreen::believes(const ImuSample& sample) {
  if (sample.specific_force_mps2.norm() > config_.max_force_mps2 ||
      sample.angular_rate_radps.norm() > config_.max_rate_radps) {
    return false;
  }
  if (last_ && !agree(*last_, sample) && !(doubted_ && agree(*doubted_, sample))) {
    doubted_ = sample;
    return false;
  }
  last_ = sample;
  doubted_.reset();
  return true;
}

// Long after the last sample nothing is known of what the next can be.
bool ImuScreen::agree(const ImuSample& a, const ImuSample& b) const {
  constexpr double kLong_s = 0.2;
  return seconds(b.time_ns - a.time_ns) > kLong_s ||
         ((b.specific_force_mps2 - a.specific_force_mps2).norm() <= config_.max_force_jump_mps2 &&
          (b.angular_rate_radps - a.angular_rate_radps).norm() <= config_.max_rate_jump_radps);
}

}  // namespace topoloc::estimation
