// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/standstill.hpp"

#include <cmath>

namespace topoloc::estimation {

void StandstillDetector::restart(std::int64_t time_ns) {
  quiet_since_ns_ = time_ns;
  has_imu_ = false;
}

void StandstillDetector::add_imu(const ImuSample& sample) {
  if (!wheels_stand_) {
    return;
  }
  const Eigen::Vector3d& rate = sample.angular_rate_radps;
  const Eigen::Vector3d& force = sample.specific_force_mps2;
  if (!has_imu_) {
    rate_min_ = rate_max_ = rate;
    force_min_ = force_max_ = force;
    has_imu_ = true;
    return;
  }
  rate_min_ = rate_min_.cwiseMin(rate);
  rate_max_ = rate_max_.cwiseMax(rate);
  force_min_ = force_min_.cwiseMin(force);
  force_max_ = force_max_.cwiseMax(force);
  const bool quiet = (rate_max_ - rate_min_).maxCoeff() <= model_.max_rate_span_radps &&
                     (force_max_ - force_min_).maxCoeff() <= model_.max_force_span_mps2;
  if (!quiet) {
    restart(sample.time_ns);
  }
}

bool StandstillDetector::add_speed(const SpeedSample& sample) {
  const bool zero = std::abs(sample.speed_mps) <= model_.max_speed_mps;
  if (!zero) {
    wheels_stand_ = false;
    return false;
  }
  if (!wheels_stand_) {
    wheels_stand_ = true;
    restart(sample.time_ns);
  }
  return has_imu_ &&
         static_cast<double>(sample.time_ns - quiet_since_ns_) * 1e-9 >= model_.min_duration_s;
}

}  // namespace topoloc::estimation
