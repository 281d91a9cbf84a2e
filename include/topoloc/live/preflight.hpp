// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::live {

enum class CheckVerdict : std::uint8_t {
  kOk,
  kWarning,  ///< the process runs, but not as well as it could
  kError,    ///< it does not run
};
const char* name(CheckVerdict verdict);

struct Check {
  std::string what;  ///< "CAN signals", "map and models"
  CheckVerdict verdict = CheckVerdict::kOk;
  std::string text;  ///< what was found and, if it is not well, what to do about it
};

/// Tries everything that the vehicle process needs, without starting it: DBC files, CAN interfaces
/// and their buffers, LCM and its buffer, camera, map and models, journal, last pose, real-time
/// priority, CPU and memory locking. Each as the process itself would do it.
std::vector<Check> preflight(const config::VehicleConfig& vehicle,
                             const std::optional<std::filesystem::path>& map);

}  // namespace topoloc::live
