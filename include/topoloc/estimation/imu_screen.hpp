// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"

#include <optional>

namespace topoloc::estimation {

/// What an IMU on a road vehicle can measure at most, and by how much neighbouring samples differ.
struct ImuScreenConfig {
  double max_force_mps2 = 80.0;       ///< magnitude of the specific force
  double max_rate_radps = 6.0;        ///< magnitude of the angular rate
  double max_force_jump_mps2 = 40.0;  ///< between samples: beyond that it is doubted
  double max_rate_jump_radps = 1.0;
};

/// Keeps damaged inertial samples (flipped bits) from the filter, which has no other defence
/// against them: it integrates them. A sample that leaps is believed once the next one agrees.
class ImuScreen {
 public:
  explicit ImuScreen(const ImuScreenConfig& config) : config_(config) {}

  /// Samples in the order of time, all finite.
  bool believes(const ImuSample& sample);

 private:
  [[nodiscard]] bool agree(const ImuSample& a, const ImuSample& b) const;

  ImuScreenConfig config_;
  std::optional<ImuSample> last_;     ///< believed
  std::optional<ImuSample> doubted_;  ///< newer than that
};

}  // namespace topoloc::estimation
