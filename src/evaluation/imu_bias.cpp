// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/imu_bias.hpp"

#include "topoloc/evaluation/motion.hpp"
#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace topoloc::evaluation {
namespace {

constexpr std::int64_t kWindow_ns = 1'000'000'000;
constexpr std::int64_t kMaxReferenceGap_ns = 200'000'000;
constexpr int kMinWindowSamples = 10;
constexpr std::size_t kMinWindows = 3;

/// Errors of one window: angular rate, then specific force.
using WindowError = Eigen::Matrix<double, 6, 1>;

/// Mean of the measurements after `from` up to `to` less what the reference says.
std::optional<WindowError> window_error(const Trajectory& reference, const MotionSample& from,
                                        const MotionSample& to,
                                        std::span<const estimation::ImuSample> imu,
                                        double gravity_mps2) {
  const auto T_from = pose_at(reference, from.time_ns, kMaxReferenceGap_ns);
  const auto T_to = pose_at(reference, to.time_ns, kMaxReferenceGap_ns);
  if (!T_from || !T_to) {
    return std::nullopt;
  }
  const double duration_s = static_cast<double>(to.time_ns - from.time_ns) * 1e-9;
  const Eigen::Vector3d rate = so3::log(T_from->R.transpose() * T_to->R) / duration_s;
  const Eigen::Vector3d acceleration =
      (T_to->R * to.velocity_imu_mps - T_from->R * from.velocity_imu_mps) / duration_s;
  const Eigen::Vector3d force_world = acceleration + Eigen::Vector3d(0.0, 0.0, gravity_mps2);
  const auto later = [](std::int64_t time_ns, const estimation::ImuSample& sample) {
    return time_ns < sample.time_ns;
  };
  WindowError sum = WindowError::Zero();
  int count = 0;
  for (auto sample = std::upper_bound(imu.begin(), imu.end(), from.time_ns, later);
       sample != imu.end() && sample->time_ns <= to.time_ns; ++sample) {
    const auto T = pose_at(reference, sample->time_ns, kMaxReferenceGap_ns);
    if (!T) {
      return std::nullopt;
    }
    sum.head<3>() += sample->angular_rate_radps - rate;
    sum.tail<3>() += sample->specific_force_mps2 - T->R.transpose() * force_world;
    ++count;
  }
  return count < kMinWindowSamples ? std::nullopt : std::optional<WindowError>(sum / count);
}

}  // namespace

ImuBias estimate_imu_bias(const Trajectory& reference, std::span<const estimation::ImuSample> imu,
                          double gravity_mps2) {
  const std::vector<MotionSample> motion = differentiate(reference);
  std::vector<WindowError> errors;
  for (std::size_t begin = 0, i = 1; i < motion.size(); ++i) {
    if (motion[i].time_ns - motion[begin].time_ns < kWindow_ns) {
      continue;
    }
    if (const auto error = window_error(reference, motion[begin], motion[i], imu, gravity_mps2)) {
      errors.push_back(*error);
    }
    begin = i;
  }
  ImuBias bias;
  if (errors.size() < kMinWindows) {
    return bias;
  }
  bias.windows = errors.size();
  const auto n = static_cast<double>(errors.size());
  WindowError mean = WindowError::Zero();
  WindowError variance = WindowError::Zero();
  for (const WindowError& error : errors) {
    mean += error / n;
  }
  for (const WindowError& error : errors) {
    variance += (error - mean).cwiseAbs2() / (n - 1.0);
  }
  const WindowError std = (variance / n).cwiseSqrt();
  bias.gyro_radps = mean.head<3>();
  bias.accel_mps2 = mean.tail<3>();
  bias.gyro_std_radps = std.head<3>();
  bias.accel_std_mps2 = std.tail<3>();
  return bias;
}

}  // namespace topoloc::evaluation
