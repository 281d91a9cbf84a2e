// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/standing.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace topoloc::refinement {
namespace {

/// When the wheels stand, without the second beside a motion.
std::vector<std::pair<std::int64_t, std::int64_t>> standing_intervals(const drive::Drive& drive) {
  constexpr std::int64_t kNods_ns = 1'000'000'000;
  const double most_mps = drive.vehicle.estimator.models.standstill.max_speed_mps;
  std::vector<std::pair<std::int64_t, std::int64_t>> intervals;
  const std::vector<estimation::SpeedSample>& speeds = drive.speed;
  for (std::size_t k = 0; k < speeds.size();) {
    if (std::abs(speeds[k].speed_mps) > most_mps) {
      ++k;
      continue;
    }
    const std::size_t first = k;
    while (k < speeds.size() && std::abs(speeds[k].speed_mps) <= most_mps) {
      ++k;
    }
    const std::int64_t from_ns = speeds[first].time_ns + (first > 0 ? kNods_ns : 0);
    const std::int64_t to_ns = speeds[k - 1].time_ns - (k < speeds.size() ? kNods_ns : 0);
    if (from_ns < to_ns) {
      intervals.emplace_back(from_ns, to_ns);
    }
  }
  return intervals;
}

}  // namespace

std::optional<Standing> standing(const drive::Drive& drive) {
  constexpr double kLeast_s = 0.5;
  Standing sum;
  double samples = 0.0;
  double seconds = 0.0;
  auto sample = drive.imu.begin();
  for (const auto& [from_ns, to_ns] : standing_intervals(drive)) {
    seconds += evaluation::kSecondsPerNs * static_cast<double>(to_ns - from_ns);
    for (; sample != drive.imu.end() && sample->time_ns < to_ns; ++sample) {
      if (sample->time_ns >= from_ns) {
        sum.specific_force_mps2 += sample->specific_force_mps2;
        sum.angular_rate_radps += sample->angular_rate_radps;
        samples += 1.0;
      }
    }
  }
  if (seconds < kLeast_s || samples == 0.0) {
    return std::nullopt;
  }
  return Standing{sum.specific_force_mps2 / samples, sum.angular_rate_radps / samples};
}

}  // namespace topoloc::refinement
