// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdlib>
#include <filesystem>

/// Where tests find shared drives; tests are skipped where they are absent.
namespace topoloc::testing {

/// Environment variable TOPOLOC_DATA, else ../shared/data beside the source tree.
inline std::filesystem::path data_dir() {
  const char* from_environment = std::getenv("TOPOLOC_DATA");
  return from_environment != nullptr
             ? std::filesystem::path(from_environment)
             : std::filesystem::path(TOPOLOC_SOURCE_DIR).parent_path() / "shared" / "data";
}

}  // namespace topoloc::testing
