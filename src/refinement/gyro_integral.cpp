// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/gyro_integral.hpp"

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/geometry/so3.hpp"

#include <algorithm>

namespace topoloc::refinement {

GyroIntegral::GyroIntegral(std::span<const estimation::ImuSample> samples,
                           const Eigen::Vector3d& bias_radps)
    : samples_(samples), bias_radps_(bias_radps) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    R_first_each_.push_back(R);
    if (i + 1 < samples.size()) {
      const double seconds = evaluation::kSecondsPerNs *
                             static_cast<double>(samples[i + 1].time_ns - samples[i].time_ns);
      const Eigen::Vector3d rate =
          0.5 * (samples[i].angular_rate_radps + samples[i + 1].angular_rate_radps);
      R = R * so3::exp(seconds * (rate - bias_radps));
    }
  }
}

Eigen::Matrix3d GyroIntegral::between(std::int64_t from_ns, std::int64_t to_ns) const {
  return until(from_ns).transpose() * until(to_ns);
}

Eigen::Matrix3d GyroIntegral::until(std::int64_t time_ns) const {
  const auto after = std::upper_bound(
      samples_.begin(), samples_.end(), time_ns,
      [](std::int64_t t, const estimation::ImuSample& sample) { return t < sample.time_ns; });
  if (samples_.empty() || after == samples_.begin()) {
    return Eigen::Matrix3d::Identity();
  }
  if (after == samples_.end()) {
    return R_first_each_.back();
  }
  const estimation::ImuSample& before = *(after - 1);
  const double whole_s =
      evaluation::kSecondsPerNs * static_cast<double>(after->time_ns - before.time_ns);
  const double part_s = evaluation::kSecondsPerNs * static_cast<double>(time_ns - before.time_ns);
  // Mean rate of the part: the rate changes in a straight line.
  const Eigen::Vector3d rate =
      before.angular_rate_radps +
      0.5 * part_s / whole_s * (after->angular_rate_radps - before.angular_rate_radps);
  const auto index = static_cast<std::size_t>(after - samples_.begin()) - 1;
  return R_first_each_[index] * so3::exp(part_s * (rate - bias_radps_));
}

}  // namespace topoloc::refinement
