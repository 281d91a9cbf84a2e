// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "mapping/scratch_file.hpp"
#include "mapping/sorted_points.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace topoloc::mapping {

/// x, y, z relative to the cloud's origin, intensity.
using StoredPoint = std::array<float, 4>;

/// Where in the scratch file one sorted run lies; in points.
struct RunExtent {
  std::uint64_t begin;
  std::uint64_t end;
};

/// Sorted runs of points on disk, and their merging into one.
class RunFile {
 public:
  explicit RunFile(const CloudStorage& storage);

  /// What append() needs besides its argument.
  static std::uint64_t write_buffer_bytes(const CloudStorage& storage);

  void append(const PointsInMemory& sorted);
  /// All points cell by cell, mapped from a second scratch file; of points in one cell, those of
  /// earlier runs first. Uses up the runs: their disk space is given back on the way.
  SortedPoints merge(const Progress& progress) const;

 private:
  CloudStorage storage_;
  ScratchFile file_;
  std::vector<RunExtent> runs_;
};

}  // namespace topoloc::mapping
