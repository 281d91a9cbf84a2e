// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "drive_motion.hpp"

#include "topoloc/drive/drive.hpp"
#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace {

using namespace topoloc;

constexpr std::int64_t kMaxSpeedGap_ns = 100'000'000;

/// Between the two samples around a time; nothing where they are too far apart.
std::optional<double> speed_at(const std::vector<estimation::SpeedSample>& speed,
                               std::int64_t time_ns) {
  const auto after = std::lower_bound(speed.begin(), speed.end(), time_ns,
                                      [](const estimation::SpeedSample& sample, std::int64_t time) {
                                        return sample.time_ns < time;
                                      });
  if (after == speed.begin() || after == speed.end()) {
    return std::nullopt;
  }
  const auto before = after - 1;
  const std::int64_t gap_ns = after->time_ns - before->time_ns;
  if (gap_ns > kMaxSpeedGap_ns) {
    return std::nullopt;
  }
  const double share = static_cast<double>(time_ns - before->time_ns) / static_cast<double>(gap_ns);
  return before->speed_mps + share * (after->speed_mps - before->speed_mps);
}

}  // namespace

evaluation::Mounting mounting_of(const estimation::SpeedModel& model) {
  return {.rotation_vehicle_imu_rpy_rad = so3::roll_pitch_yaw(model.R_vehicle_imu),
          .wheel_reference_imu_m = model.wheel_reference_imu_m,
          .wheel_scale = model.wheel_scale};
}

DriveMotion read_drive_motion(const std::filesystem::path& drive,
                              const std::filesystem::path& vehicle, double until_s) {
  drive::Drive recorded = drive::load_drive(drive, vehicle);
  if (!recorded.ground_truth) {
    throw std::runtime_error(drive.string() + ": no ground_truth.tum to calibrate with");
  }
  evaluation::Trajectory& reference = *recorded.ground_truth;
  if (until_s > 0.0) {
    const std::int64_t end_ns =
        recorded.imu.front().time_ns + static_cast<std::int64_t>(std::llround(until_s * 1e9));
    std::erase_if(reference, [end_ns](const auto& pose) { return pose.time_ns > end_ns; });
  }
  DriveMotion motion;
  motion.samples = evaluation::differentiate(reference);
  for (evaluation::MotionSample& sample : motion.samples) {
    sample.wheel_speed_mps = speed_at(recorded.speed, sample.time_ns);
  }
  const estimation::EstimatorConfig& config = recorded.vehicle.estimator;
  motion.given = mounting_of(config.models.speed);
  motion.imu_bias = evaluation::estimate_imu_bias(reference, recorded.imu, config.gravity_mps2);
  return motion;
}
