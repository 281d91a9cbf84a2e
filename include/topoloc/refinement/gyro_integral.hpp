// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace topoloc::refinement {

/// Rotation by angular rates alone, straight lines between the samples.
class GyroIntegral {
 public:
  /// `samples` in time order, `bias_radps` is taken off them.
  GyroIntegral(std::span<const estimation::ImuSample> samples, const Eigen::Vector3d& bias_radps);

  /// R_from_to of the IMU between two times; before the first and after the last sample it does not
  /// turn.
  [[nodiscard]] Eigen::Matrix3d between(std::int64_t from_ns, std::int64_t to_ns) const;

 private:
  [[nodiscard]] Eigen::Matrix3d until(std::int64_t time_ns) const;

  std::span<const estimation::ImuSample> samples_;
  Eigen::Vector3d bias_radps_;
  std::vector<Eigen::Matrix3d> R_first_each_;  // from the first sample to each
};

}  // namespace topoloc::refinement
