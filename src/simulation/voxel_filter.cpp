// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/voxel_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace topoloc::simulation {
namespace {

/// 20 bits for each coordinate, the rest for the edge [cm], modulo 16: enough to tell a survey's
/// three edges apart. Never 0, which marks an empty slot. Cubes 2^20 edges apart share a number:
/// that is tens of kilometres.
std::uint64_t cube(const Eigen::Vector3d& p, double edge_m) {
  constexpr std::uint64_t kMask = (1U << 20U) - 1U;
  const auto part = [&](double value) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(value / edge_m))) &
           kMask;
  };
  const auto edge = static_cast<std::uint64_t>(std::lround(edge_m * 100.0)) & 15U;
  return (part(p.x()) | part(p.y()) << 20U | part(p.z()) << 40U | edge << 60U) + 1U;
}

}  // namespace

std::size_t VoxelFilter::Set::place(std::uint64_t key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15U) >> 20U) & mask;
  while (slots_[at] != 0 && slots_[at] != key) {
    at = (at + 1) & mask;
  }
  return at;
}

bool VoxelFilter::Set::contains(std::uint64_t key) const { return slots_[place(key)] == key; }

bool VoxelFilter::Set::insert(std::uint64_t key) {
  std::uint64_t& slot = slots_[place(key)];
  if (slot == key) {
    return false;
  }
  slot = key;
  if (2 * ++size_ > slots_.size()) {
    grow();
  }
  return true;
}

void VoxelFilter::Set::grow() {
  std::vector<std::uint64_t> old(2 * slots_.size(), 0);
  std::swap(old, slots_);
  for (const std::uint64_t key : old) {
    if (key != 0) {
      slots_[place(key)] = key;
    }
  }
}

void VoxelFilter::Set::clear() {
  std::fill(slots_.begin(), slots_.end(), 0U);
  size_ = 0;
}

void VoxelFilter::advance(double way_m) {
  if (way_m - begin_m_ >= remember_m_) {
    std::swap(older_, newer_);
    newer_.clear();
    begin_m_ = way_m;
  }
}

bool VoxelFilter::keep(const Eigen::Vector3d& p_world_m, double edge_m) {
  const std::uint64_t key = cube(p_world_m, edge_m);
  return !older_.contains(key) && newer_.insert(key);
}

}  // namespace topoloc::simulation
