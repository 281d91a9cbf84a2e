// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::testing {

/// Counts heap allocations (operator new) of this thread between construction and count().
/// A test binary that uses it compiles support/allocation_trap.cpp, which replaces operator new.
class AllocationTrap {
 public:
  AllocationTrap();
  [[nodiscard]] std::uint64_t count() const;

 private:
  std::uint64_t before_;
};

}  // namespace topoloc::testing
