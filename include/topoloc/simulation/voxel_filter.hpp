// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace topoloc::simulation {

/// Keeps the first point in every cube of space, as far as it remembers: so much way back that
/// memory does not grow with the drive.
class VoxelFilter {
 public:
  /// `remember_m`: of way.
  explicit VoxelFilter(double remember_m) : remember_m_(remember_m) {}

  /// Tells where along the way the next points come from.
  void advance(double way_m);
  /// Whether the point is the first in its cube of this edge. Cubes of different edges are
  /// different cubes.
  bool keep(const Eigen::Vector3d& p_world_m, double edge_m);

 private:
  /// A set of numbers: open addressing.
  class Set {
   public:
    bool insert(std::uint64_t key);  ///< false where it was there
    [[nodiscard]] bool contains(std::uint64_t key) const;
    void clear();

   private:
    [[nodiscard]] std::size_t place(std::uint64_t key) const;
    void grow();

    std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(1U << 16U, 0);
    std::size_t size_ = 0;
  };

  double remember_m_;
  double begin_m_ = 0.0;  ///< of the newer set
  Set newer_;
  Set older_;
};

}  // namespace topoloc::simulation
