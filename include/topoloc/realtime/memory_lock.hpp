// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

/// Keeping page faults away from threads that cannot wait for them.
namespace topoloc::realtime {

struct MemoryLock {
  bool locked = false;
  std::uint64_t locked_bytes = 0;  ///< of the process, as the kernel counts them
  std::string warning;             ///< empty if locked: why not, and what to do about it
};

/// Locks into memory, and so reads in, everything the process has mapped by now.
///
/// Call it when all threads and buffers exist and before the map is mapped. What is mapped later is
/// not locked: MCL_FUTURE would read in and pin the whole map, which may be larger than memory.
/// Stacks of all threads are locked whole. Any thread; does not throw for want of privilege.
MemoryLock lock_memory();
/// Undoes it.
void unlock_memory();

/// Lets the heap keep what it has: freed blocks up to 32 MB go back to the heap instead of the
/// system, and this thread's heap gets `reserve_bytes` (up to 512 MB) of pages beforehand.
///
/// Threads that may allocate do so with fewer page faults, and give no memory back: munmap makes
/// the kernel interrupt every core that runs a thread of the process, the estimator's too. Costs
/// the memory. Before threads are started.
void keep_heap(std::size_t reserve_bytes);

/// Touches up to `bytes` of the calling thread's stack below here, as far as there is stack.
/// Returns how much that was. For the main thread; realtime::Thread does it by itself.
std::size_t prefault_stack(std::size_t bytes);

struct PageFaults {
  std::uint64_t minor = 0;  ///< served from memory
  std::uint64_t major = 0;  ///< waited for a disk
};

/// Of the calling thread since it began; one system call. A thread that must not wait has none
/// between two calls.
[[nodiscard]] PageFaults thread_page_faults();

}  // namespace topoloc::realtime
