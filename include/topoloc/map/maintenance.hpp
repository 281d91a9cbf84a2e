// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace topoloc::map {

/// One thing that is wrong with a map file.
struct VerifyProblem {
  std::string section;       ///< name of the section, or "file" where the map cannot even be opened
  std::uint64_t offset = 0;  ///< byte in the file from which on it is wrong
  std::string what;
};

struct VerifyReport {
  std::size_t node_count = 0;
  std::uint64_t bytes_checked = 0;
  std::vector<VerifyProblem> problems;  ///< at most 20 for each section

  [[nodiscard]] bool ok() const { return problems.empty(); }
};

/// Reads every byte of a map: all checksums, all values of features, all depth images.
/// Throws MapError only if the file cannot be read at all; damage is in the report.
VerifyReport verify(const std::filesystem::path& path);

/// Writes the map without its images; all other sections stay as they are, byte for byte. Atomic,
/// so `out` may be `in`. Throws MapError.
void strip(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace topoloc::map
