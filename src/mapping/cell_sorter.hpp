// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "mapping/cell_key.hpp"
#include "mapping/run_merge.hpp"
#include "mapping/sorted_points.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

namespace topoloc::mapping {

/// Sorts points cell by cell within a given amount of memory: what does not fit is written to disk
/// in sorted runs, which are merged at the end. Within a cell, points keep the order in which they
/// came, so that the result does not depend on the memory.
class CellSorter {
 public:
  explicit CellSorter(CloudStorage storage) : storage_(std::move(storage)) {}

  /// The number of points to come at most, before the first one. std::length_error beyond 2^32 - 2.
  void expect(std::uint64_t points);
  /// Position within kMaxExtent_m.
  void add(const Eigen::Vector3f& position_m, float intensity);
  /// Everything sorted; the sorter is empty then.
  SortedPoints finish(const Progress& progress = {});

 private:
  struct LocalCell {
    CellKey key;
    std::uint32_t count;
  };

  [[nodiscard]] std::uint64_t bytes_held() const;
  std::uint32_t cell_of(CellKey key);
  PointsInMemory sort() const;
  void spill();
  void clear();

  CloudStorage storage_;
  std::size_t capacity_ = 0;

  // Points since the last spill, in the order they came; cells in the order they appeared.
  std::vector<Eigen::Vector3f> positions_m_;
  std::vector<float> intensities_;
  std::vector<std::uint32_t> cell_of_point_;
  std::vector<LocalCell> cells_;
  std::unordered_map<CellKey, std::uint32_t> cell_of_key_;

  Eigen::AlignedBox3f box_m_;
  std::optional<RunFile> runs_;
  std::uint64_t peak_bytes_ = 0;
};

}  // namespace topoloc::mapping
