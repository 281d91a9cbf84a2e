// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/cloud_grid.hpp"

#include "mapping/scratch_file.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

namespace topoloc::mapping {

/// Points in memory, cell by cell.
struct PointsInMemory {
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<float> intensities;
  std::vector<CloudGrid::Cell> cells;
};

/// Points cell by cell, and what owns them. Moving it leaves the spans valid.
struct SortedPoints {
  std::span<const Eigen::Vector3f> positions_m;
  std::span<const float> intensities;
  std::span<const CloudGrid::Cell> cells;
  Eigen::AlignedBox3f box_m;
  std::size_t spilled_runs = 0;
  std::uint64_t peak_bytes = 0;

  std::variant<PointsInMemory, std::unique_ptr<FileMapping>> owner;
};

}  // namespace topoloc::mapping
