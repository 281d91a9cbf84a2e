// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/cell_sorter.hpp"

#include <algorithm>
#include <limits>
#include <malloc.h>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace topoloc::mapping {
namespace {

constexpr std::uint64_t kBytesAPoint = 16 + 4;    // as it came, with its cell
constexpr std::uint64_t kBytesASortedPoint = 16;  // its copy in the new order
/// Entries in hash table and lists; vectors may be twice as large as what they hold.
constexpr std::uint64_t kBytesACell = 160;
/// What the next point takes at most.
constexpr std::uint64_t kBytesNext = kBytesAPoint + kBytesASortedPoint + kBytesACell;

}  // namespace

void CellSorter::expect(std::uint64_t points) {
  if (points >= std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("point cloud has more than 2^32 - 2 points: split it");
  }
  const std::uint64_t buffer = RunFile::write_buffer_bytes(storage_);
  const std::uint64_t affordable =
      (storage_.memory_bytes - std::min(buffer, storage_.memory_bytes)) /
      (kBytesAPoint + kBytesASortedPoint);
  capacity_ = std::max<std::uint64_t>(1, std::min(points, affordable));
  // All at once: a vector that grows holds its points twice for a while.
  positions_m_.reserve(capacity_);
  intensities_.reserve(capacity_);
  cell_of_point_.reserve(capacity_);
}

std::uint64_t CellSorter::bytes_held() const {
  return positions_m_.size() * (kBytesAPoint + kBytesASortedPoint) + cells_.size() * kBytesACell +
         RunFile::write_buffer_bytes(storage_);
}

std::uint32_t CellSorter::cell_of(CellKey key) {
  // Neighbours in a file mostly are neighbours in space.
  if (!cell_of_point_.empty() && cells_[cell_of_point_.back()].key == key) {
    return cell_of_point_.back();
  }
  const auto [it, is_new] =
      cell_of_key_.try_emplace(key, static_cast<std::uint32_t>(cells_.size()));
  if (is_new) {
    cells_.push_back({key, 0});
  }
  return it->second;
}

void CellSorter::add(const Eigen::Vector3f& position_m, float intensity) {
  if (positions_m_.size() == capacity_ ||
      (!positions_m_.empty() && bytes_held() + kBytesNext > storage_.memory_bytes)) {
    spill();
  }
  const std::uint32_t cell = cell_of(cell_key(position_m));
  ++cells_[cell].count;
  positions_m_.push_back(position_m);
  intensities_.push_back(intensity);
  cell_of_point_.push_back(cell);
  box_m_.extend(position_m);
}

/// Counting sort: the number of points per cell is known.
PointsInMemory CellSorter::sort() const {
  std::vector<std::uint32_t> order(cells_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return cells_[a].key < cells_[b].key; });
  PointsInMemory sorted;
  sorted.cells.reserve(cells_.size());
  std::vector<std::uint32_t> next(cells_.size());  // where the next point of a cell goes
  std::uint32_t begin = 0;
  for (const std::uint32_t cell : order) {
    next[cell] = begin;
    sorted.cells.push_back(empty_cell(cells_[cell].key, begin));
    begin += cells_[cell].count;
    sorted.cells.back().end = begin;
  }
  sorted.positions_m.resize(positions_m_.size());
  sorted.intensities.resize(positions_m_.size());
  for (std::size_t i = 0; i < positions_m_.size(); ++i) {
    const std::uint32_t to = next[cell_of_point_[i]]++;
    sorted.positions_m[to] = positions_m_[i];
    sorted.intensities[to] = intensities_[i];
  }
  return sorted;
}

void CellSorter::spill() {
  peak_bytes_ = std::max(peak_bytes_, bytes_held());
  if (!runs_) {
    runs_.emplace(storage_);
  }
  runs_->append(sort());
  clear();
}

/// Keeps the room for points.
void CellSorter::clear() {
  positions_m_.clear();
  intensities_.clear();
  cell_of_point_.clear();
  cells_.clear();
  cell_of_key_.clear();
}

SortedPoints CellSorter::finish(const Progress& progress) {
  SortedPoints points;
  if (runs_) {
    spill();
    positions_m_ = {};
    intensities_ = {};
    cell_of_point_ = {};
    points = runs_->merge(progress);
    runs_.reset();
    // The heap would keep what sorting held, beside the pages that the cloud is used through.
    ::malloc_trim(0);
  } else {
    peak_bytes_ = bytes_held();
    PointsInMemory sorted = sort();
    clear();
    points.positions_m = sorted.positions_m;
    points.intensities = sorted.intensities;
    points.cells = sorted.cells;
    points.owner = std::move(sorted);
  }
  points.box_m = box_m_;
  points.peak_bytes = std::max(points.peak_bytes, peak_bytes_);
  return points;
}

}  // namespace topoloc::mapping
