// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/evaluation/trajectory.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <vector>

namespace topoloc::localiser {

/// Folder of a drive of 2 s along x at 14 m/s, without camera.lcm. All logs can be written again.
class StraightDrive {
 public:
  static constexpr std::int64_t kStart_us = 1'700'000'000'000'000;
  static constexpr double kSpeed_mps = 14.0;

  StraightDrive() {
    folder.write_can_log(rows());
    write_truth(0);
  }

  /// 100 Hz, 201 of them.
  static std::vector<testing::CanRow> rows() {
    std::vector<testing::CanRow> out;
    for (int i = 0; i <= 200; ++i) {
      out.push_back({.time_us = kStart_us + 10'000 * i, .speed_mps = kSpeed_mps});
    }
    return out;
  }
  static double x_m(std::int64_t time_ns) {
    return kSpeed_mps * 1e-9 * static_cast<double>(time_ns - 1000 * kStart_us);
  }
  /// Poses at 10 Hz, the first so long after the first inertial sample.
  void write_truth(std::int64_t delay_ns) const {
    evaluation::Trajectory truth;
    for (std::int64_t t = 1000 * kStart_us + delay_ns; t <= 1000 * (kStart_us + 2'000'000);
         t += 100'000'000) {
      truth.push_back({t, {Eigen::Matrix3d::Identity(), {x_m(t), 0.0, 0.0}}});
    }
    evaluation::write_tum(folder / "ground_truth.tum", truth);
  }
  [[nodiscard]] drive::Drive load() const { return drive::load_drive(folder.dir()); }

  testing::TemporaryFolder temporary;
  testing::DriveFolder folder{temporary / "drive", testing::tiny_camera()};
};

}  // namespace topoloc::localiser
