// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/geometry/so3.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <cmath>
#include <vector>

namespace topoloc::refinement {

/// Folder of a drive round a bend at constant speed, without camera.lcm.
class TurningDrive {
 public:
  static constexpr std::int64_t kStart_us = 1'700'000'000'000'000;
  static constexpr double kSpeed_mps = 8.0;
  static constexpr double kRate_radps = 0.2;
  static constexpr double kSeconds = 12.0;

  /// `bias_radps`: what the gyro shows too much about the vertical.
  explicit TurningDrive(double bias_radps = 0.0) {
    constexpr int kRate_hz = 100;
    std::vector<testing::CanRow> rows;
    for (int i = 0; i <= static_cast<int>(kSeconds * kRate_hz); ++i) {
      rows.push_back({.time_us = kStart_us + 1'000'000 / kRate_hz * i,
                      .specific_force_mps2 = {0.0, kSpeed_mps * kRate_radps, 9.81},
                      .angular_rate_radps = {0.0, 0.0, kRate_radps + bias_radps},
                      .speed_mps = kSpeed_mps});
    }
    folder.write_can_log(rows);
  }

  static double seconds(std::int64_t time_ns) {
    return 1e-9 * static_cast<double>(time_ns - 1000 * kStart_us);
  }
  static RigidTransform pose_at_s(double t) {
    const double angle = kRate_radps * t;
    const double radius_m = kSpeed_mps / kRate_radps;
    return {so3::exp({0.0, 0.0, angle}),
            {radius_m * std::sin(angle), radius_m * (1.0 - std::cos(angle)), 0.0}};
  }
  [[nodiscard]] drive::Drive load() const { return drive::load_drive(folder.dir()); }

  testing::TemporaryFolder temporary;
  testing::DriveFolder folder{temporary / "drive", testing::tiny_camera()};
};

}  // namespace topoloc::refinement
