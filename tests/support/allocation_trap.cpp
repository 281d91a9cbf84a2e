// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "support/allocation_trap.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdlib>

namespace {

thread_local std::uint64_t allocations = 0;

}  // namespace

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

extern "C" {

// glibc's own, under the names it exports for wrappers of malloc. NOLINTBEGIN(*reserved-identifier)
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
// NOLINTEND(*reserved-identifier)

void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  ++allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
  ++allocations;
  return __libc_realloc(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  ++allocations;
  void* aligned = __libc_memalign(alignment, size);
  if (aligned == nullptr) {
    return ENOMEM;
  }
  *memory = aligned;
  return 0;
}

}  // extern "C"

const bool topoloc::testing::AllocationTrap::kAvailable = true;

#else

const bool topoloc::testing::AllocationTrap::kAvailable = false;

#endif

namespace topoloc::testing {

AllocationTrap::AllocationTrap() : before_(allocations) {}

std::uint64_t AllocationTrap::count() const { return allocations - before_; }

}  // namespace topoloc::testing
