// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/cloud_grid.hpp"

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace topoloc::mapping {

/// A cell in one number, ordered as (x, y, z): 21 bits each, which is more than kMaxExtent_m needs.
using CellKey = std::uint64_t;

inline constexpr std::int32_t kCellKeyOffset = 1 << 20;
static_assert(kMaxExtent_m / CloudGrid::kCellSize_m < kCellKeyOffset);

/// Of a position relative to the cloud's origin, within kMaxExtent_m. A point on a border belongs
/// to the cell that begins there.
inline CellKey cell_key(const Eigen::Vector3f& position_m) {
  const auto index = [](float coordinate_m) {
    const double cell = std::floor(static_cast<double>(coordinate_m) / CloudGrid::kCellSize_m);
    return static_cast<CellKey>(static_cast<std::int32_t>(cell) + kCellKeyOffset);
  };
  return index(position_m.x()) << 42U | index(position_m.y()) << 21U | index(position_m.z());
}

/// The cell of a key, with no points in it.
inline CloudGrid::Cell empty_cell(CellKey key, std::uint32_t begin) {
  const auto index = [key](unsigned shift) {
    return static_cast<std::int32_t>(key >> shift & 0x1FFFFFU) - kCellKeyOffset;
  };
  return {index(42), index(21), index(0), begin, begin};
}

}  // namespace topoloc::mapping
