// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <filesystem>
#include <string>

namespace topoloc::config {

/// The text of a vehicle.yaml for another folder: relative paths in it are changed so that they
/// name the same files as in `from`; absolute where the two have no folder but the root in common.
/// Everything else, comments included, stays. Throws std::runtime_error where the text is no YAML
/// or a path is spread over lines.
std::string relocated(const std::string& vehicle_yaml, const std::filesystem::path& from,
                      const std::filesystem::path& to);

}  // namespace topoloc::config
