// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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
  static constexpr std::size_t kMaxProblems = 20;

  std::size_t node_count = 0;
  std::vector<VerifyProblem> problems;  ///< at most kMaxProblems

  [[nodiscard]] bool ok() const { return problems.empty(); }
};

/// Reads every byte of a map: all checksums, all values of features, all depth and intensity
/// images, the build report.
/// Never throws MapError: that a file cannot be opened is in the report too. `progress` is called
/// now and then with the bytes done and the bytes to do.
VerifyReport verify(const std::filesystem::path& path,
                    const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

/// Writes the map without its images; all other sections stay as they are, byte for byte. Atomic,
/// so `out` may be `in`. Throws MapError.
void strip(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace topoloc::map
