// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "mapping/cloud_reader.hpp"
#include "mapping/record_layout.hpp"

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string>
#include <vector>

/// Reading points out of the body of a PCD or PLY file.
namespace topoloc::mapping {

/// Words of a line, split at white space.
std::vector<std::string> split_words(const std::string& line);

/// A non-negative count; throws naming `what` if it is not one.
std::uint64_t parse_count(const std::filesystem::path& path, const std::string& word,
                          const std::string& what);

/// Bytes from the stream's position to the end of the file.
std::uint64_t bytes_left(std::istream& stream);

/// `count` points of one layout.
struct Records {
  const RecordLayout& layout;
  std::uint64_t count;
};

/// Text rows of numbers; `first_line` is the line number of the row to come.
void read_ascii_points(const std::filesystem::path& path, std::istream& stream,
                       const Records& records, std::uint64_t first_line, PointSink& sink,
                       const Progress& progress);

/// Packed records.
void read_binary_points(const std::filesystem::path& path, std::istream& stream,
                        const Records& records, bool swap_bytes, PointSink& sink,
                        const Progress& progress);

}  // namespace topoloc::mapping
