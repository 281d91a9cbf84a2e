// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/estimation/speed_measurement.hpp"

#include <cstdint>

#include <Eigen/Core>

namespace topoloc::estimation {

/// Decides from raw data alone whether the vehicle stands: all wheels read zero and neither rate
/// nor specific force has moved for a while. Spans, not levels, so that biases do not matter; raw
/// data, so that the decision does not depend on when map matches arrive.
class StandstillDetector {
 public:
  explicit StandstillDetector(const StandstillModel& model) : model_(model) {}

  void add_imu(const ImuSample& sample);
  /// Takes the next speed; true if the vehicle stands at its time.
  bool add_speed(const SpeedSample& sample);

 private:
  void restart(std::int64_t time_ns);

  StandstillModel model_;
  bool wheels_stand_ = false;
  bool has_imu_ = false;
  std::int64_t quiet_since_ns_ = 0;
  Eigen::Vector3d rate_min_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_max_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_min_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_max_ = Eigen::Vector3d::Zero();
};

}  // namespace topoloc::estimation
