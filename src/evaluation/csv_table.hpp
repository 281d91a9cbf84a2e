// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace topoloc::evaluation {

struct CsvRow {
  std::int64_t time_ns = 0;
  std::vector<double> values;  ///< in the order asked for
};

/// Reads the named columns of a comma-separated file with a header line, plain or gzip.
/// Throws std::runtime_error "file:line: ..." on missing columns, rows of another length, values
/// that are not finite numbers, times that do not increase, a truncated archive, and no rows.
std::vector<CsvRow> read_csv(const std::filesystem::path& path, const std::string& time_column,
                             const std::vector<std::string>& columns);

}  // namespace topoloc::evaluation
