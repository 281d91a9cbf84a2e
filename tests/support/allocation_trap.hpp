// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::testing {

/// Counts heap allocations of this thread between construction and count(), at malloc's level:
/// Eigen allocates there, past operator new.
/// A test binary that uses it links support/allocation_trap.cpp, which wraps glibc's malloc.
class AllocationTrap {
 public:
  /// False under sanitizers, which bring their own malloc: count() is then always zero.
  static const bool kAvailable;

  AllocationTrap();
  [[nodiscard]] std::uint64_t count() const;

 private:
  std::uint64_t before_;
};

}  // namespace topoloc::testing
