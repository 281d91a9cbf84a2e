// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/tick.hpp"

namespace topoloc::live {

TickRunner::TickRunner(const estimation::EstimatorConfig& config) : estimator_(config) {}

const TickOutput& TickRunner::run(const TickInput& input, const estimation::MapMatchSet* set) {
  const estimation::TickInputs inputs{.imu = std::span(input.imu).first(input.imu_count),
                                      .speed = std::span(input.speed).first(input.speed_count),
                                      .matches = std::span(&set, set != nullptr ? 1 : 0),
                                      .initial_pose = input.initial_pose};
  output_.tick = input.tick;
  output_.now_ns = input.now_ns;
  output_.system_offset_ns = input.system_offset_ns;
  output_.estimate = estimator_.tick(input.now_ns, inputs);
  if (input.imu_count > 0) {
    output_.imu = input.imu[input.imu_count - 1];
  }
  if (input.speed_count > 0) {
    output_.speed = input.speed[input.speed_count - 1];
  }
  return output_;
}

}  // namespace topoloc::live
