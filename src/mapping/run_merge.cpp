// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/run_merge.hpp"

#include "mapping/cell_key.hpp"
#include "mapping/cloud_reader.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <span>
#include <utility>

namespace topoloc::mapping {
namespace {

constexpr std::uint64_t kSmallestBlock = 4096;      // bytes
constexpr std::uint64_t kLargestBlock = 4U << 20U;  // beyond, a disk gets no faster

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
static_assert(sizeof(CloudGrid::Cell) == 5 * sizeof(std::uint32_t));

/// Goes through one run, a block at a time.
class RunReader {
 public:
  RunReader(const ScratchFile& file, RunExtent extent, std::uint64_t block_bytes)
      : file_(&file), next_(extent.begin), end_(extent.end) {
    block_.reserve(block_bytes / sizeof(StoredPoint));
    load();
  }
  [[nodiscard]] bool done() const { return at_ == block_.size(); }
  [[nodiscard]] const StoredPoint& point() const { return block_[at_]; }
  [[nodiscard]] CellKey key() const { return cell_key({point()[0], point()[1], point()[2]}); }
  void advance() {
    if (++at_ == block_.size()) {
      load();
    }
  }

 private:
  void load() {
    block_.resize(std::min<std::uint64_t>(block_.capacity(), end_ - next_));
    at_ = 0;
    const std::uint64_t offset = next_ * sizeof(StoredPoint);
    file_->read(offset, std::as_writable_bytes(std::span(block_)));
    if (!block_.empty()) {
      file_->discard(offset, block_.size() * sizeof(StoredPoint));
    }
    next_ += block_.size();
  }

  const ScratchFile* file_;
  std::uint64_t next_;
  std::uint64_t end_;
  std::vector<StoredPoint> block_;
  std::size_t at_ = 0;
};

/// Where things lie in the file of all points: positions, intensities, cells.
struct FileLayout {
  explicit FileLayout(std::uint64_t points)
      : intensities_at(points * sizeof(Eigen::Vector3f)),
        cells_at(intensities_at + points * sizeof(float)) {}
  std::uint64_t intensities_at;
  std::uint64_t cells_at;
};

template <typename T>
std::span<const T> view_of(std::span<const std::byte> bytes, std::uint64_t from, std::uint64_t to) {
  return {reinterpret_cast<const T*>(bytes.data() + from), (to - from) / sizeof(T)};
}

}  // namespace

std::uint64_t RunFile::write_buffer_bytes(const CloudStorage& storage) {
  return std::clamp<std::uint64_t>(storage.memory_bytes / 64, 1024, kLargestBlock);
}

RunFile::RunFile(const CloudStorage& storage) : storage_(storage), file_(storage.scratch_folder) {}

void RunFile::append(const PointsInMemory& sorted) {
  const std::uint64_t begin = runs_.empty() ? 0 : runs_.back().end;
  ScratchWriter writer(file_, begin * sizeof(StoredPoint), write_buffer_bytes(storage_));
  for (std::size_t i = 0; i < sorted.positions_m.size(); ++i) {
    const Eigen::Vector3f& p = sorted.positions_m[i];
    const StoredPoint point{p.x(), p.y(), p.z(), sorted.intensities[i]};
    writer.append(std::as_bytes(std::span(point)));
  }
  writer.finish();
  runs_.push_back({begin, begin + sorted.positions_m.size()});
}

SortedPoints RunFile::merge(const Progress& progress) const {
  const std::uint64_t count = runs_.back().end;
  const std::uint64_t run_block =
      std::clamp(storage_.memory_bytes / 2 / runs_.size(), kSmallestBlock, kLargestBlock);
  const std::uint64_t write_buffer = write_buffer_bytes(storage_);
  std::vector<RunReader> readers;
  readers.reserve(runs_.size());
  // Smallest cell first; of the same cell the earliest run.
  using Head = std::pair<CellKey, std::size_t>;
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads;
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    readers.emplace_back(file_, runs_[run], run_block);
    heads.emplace(readers.back().key(), run);
  }

  const FileLayout layout(count);
  ScratchFile merged(storage_.scratch_folder);
  ScratchWriter positions(merged, 0, write_buffer);
  ScratchWriter intensities(merged, layout.intensities_at, write_buffer);
  ScratchWriter cells(merged, layout.cells_at, write_buffer);
  const auto write_cell = [&cells](const CloudGrid::Cell& cell) {
    cells.append(std::as_bytes(std::span(&cell, 1)));
  };
  const ProgressTicker ticker(progress, count);
  std::uint32_t written = 0;
  CellKey current = heads.top().first;
  CloudGrid::Cell cell = empty_cell(current, 0);
  while (!heads.empty()) {
    const auto [key, run] = heads.top();
    heads.pop();
    if (key != current) {
      write_cell(cell);
      current = key;
      cell = empty_cell(key, written);
    }
    RunReader& reader = readers[run];
    for (; !reader.done() && reader.key() == key; reader.advance()) {
      const auto bytes = std::as_bytes(std::span(reader.point()));
      positions.append(bytes.first(sizeof(Eigen::Vector3f)));
      intensities.append(bytes.last(sizeof(float)));
      ticker.at(written);
      cell.end = ++written;
    }
    if (!reader.done()) {
      heads.emplace(reader.key(), run);
    }
  }
  write_cell(cell);
  positions.finish();
  intensities.finish();
  const std::uint64_t size = cells.finish();

  SortedPoints points;
  // Half, since the kernel also maps neighbours of the pages that are read.
  auto mapping = merged.map(size, storage_.memory_bytes / 2);
  const auto bytes = mapping->bytes();
  points.positions_m = view_of<Eigen::Vector3f>(bytes, 0, layout.intensities_at);
  points.intensities = view_of<float>(bytes, layout.intensities_at, layout.cells_at);
  points.cells = view_of<CloudGrid::Cell>(bytes, layout.cells_at, size);
  points.owner = std::move(mapping);
  points.spilled_runs = runs_.size();
  points.peak_bytes = runs_.size() * run_block + 3 * write_buffer;
  return points;
}

}  // namespace topoloc::mapping
