// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <vector>

namespace topoloc::evaluation {

inline constexpr double kSecondsPerNs = 1e-9;

struct StampedPose {
  std::int64_t time_ns = 0;  ///< Unix time
  RigidTransform T_world_imu;
};

/// Poses with strictly increasing times.
using Trajectory = std::vector<StampedPose>;

/// Nanoseconds of a decimal number of seconds ("1317045935.622616", "1.5e-3"), without passing
/// through a double: exact up to nine decimals, rounded to the nearest beyond. Nothing if the text
/// is not a number or does not fit 64 bits.
std::optional<std::int64_t> parse_seconds_ns(std::string_view text);

/// Reads a TUM trajectory: lines "t tx ty tz qx qy qz qw" (seconds, metres, Hamilton quaternion),
/// '#' comments, LF or CRLF. Quaternions are normalised.
/// Throws std::runtime_error "file:line: ..." on anything else: missing or surplus columns, NaN or
/// infinity, a quaternion whose norm is not 1 (to 1 %), times that do not increase, no pose at all.
Trajectory read_tum(const std::filesystem::path& path);

/// Writes a TUM trajectory pose by pose: time with nine decimals (exact), position to 1e-6 m,
/// quaternion to 1e-9 with qw >= 0. The same poses always give the same bytes. All members throw
/// std::runtime_error on I/O errors.
class TumWriter {
 public:
  explicit TumWriter(std::filesystem::path path);
  /// Throws std::runtime_error on a pose that is not finite, too.
  void write(const StampedPose& pose);
  void close();

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

/// Writes a whole trajectory with TumWriter.
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory);

/// File that lies beside a trajectory EST.tum: EST<suffix>. Only ".tum" is taken off: est_0.5 and
/// est_0.8 are two names.
std::filesystem::path beside(const std::filesystem::path& trajectory, std::string_view suffix);

/// Pose at a time, interpolated between the two neighbours (straight line, constant rotation rate).
/// Nothing outside the trajectory (never extrapolates) and nothing where the neighbours are more
/// than max_gap_ns apart; a time that the trajectory holds is always answered.
std::optional<RigidTransform> pose_at(const Trajectory& trajectory, std::int64_t time_ns,
                                      std::int64_t max_gap_ns);

}  // namespace topoloc::evaluation
