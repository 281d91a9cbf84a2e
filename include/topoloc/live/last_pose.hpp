// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>

namespace topoloc::live {

/// A pose kept over a restart of the process.
struct LastPose {
  std::int64_t time_ns = 0;  ///< Unix
  RigidTransform T_world_imu;
};

/// Writes a TUM file of one pose, whole or not at all. Returns whether it could.
bool write_last_pose(const std::filesystem::path& file, const LastPose& pose);

/// Nothing if the file is not there. Throws std::runtime_error, naming file and line, if it is
/// damaged.
std::optional<LastPose> read_last_pose(const std::filesystem::path& file);

}  // namespace topoloc::live
