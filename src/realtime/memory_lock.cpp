// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/memory_lock.hpp"

#include <algorithm>
#include <alloca.h>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <malloc.h>
#include <pthread.h>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>
#include <vector>

namespace topoloc::realtime {

namespace {

constexpr std::size_t kMegabyte = std::size_t{1} << 20;

std::size_t page_bytes() { return static_cast<std::size_t>(sysconf(_SC_PAGESIZE)); }

/// A line "Key:  123 kB" of /proc/self/status in bytes; zero if there is none.
std::uint64_t status_bytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) {
      return std::strtoull(line.c_str() + key.size() + 1, nullptr, 10) * 1024;
    }
  }
  return 0;
}

std::string in_megabytes(std::uint64_t bytes) {
  return std::to_string((bytes + kMegabyte - 1) / kMegabyte) + " MB";
}

std::string not_locked(int error) {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const std::string allowed =
      limit.rlim_cur == RLIM_INFINITY ? "unlimited" : in_megabytes(limit.rlim_cur);
  return "memory is not locked (" + std::generic_category().message(error) + "; the limit, " +
         "ulimit -l, is " + allowed + ", the process has mapped " +
         in_megabytes(status_bytes("VmSize")) + "): page faults can delay the estimator. Set " +
         "LimitMEMLOCK=infinity in the systemd unit, or give the program CAP_IPC_LOCK.";
}

/// Bytes between here and the end of this thread's stack, guard pages not among them.
std::size_t stack_left() {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) {
    return 0;
  }
  void* lowest = nullptr;
  std::size_t size = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_destroy(&attributes);
  const char here = 0;
  const auto above = reinterpret_cast<std::uintptr_t>(&here);
  const auto end = reinterpret_cast<std::uintptr_t>(lowest);
  return above > end ? above - end : 0;
}

// Not inlined: the block is given back on return.
[[gnu::noinline]] void touch_stack(std::size_t bytes) {
  auto* block = static_cast<volatile char*>(alloca(bytes));
  // From the top down, as a stack grows: the main thread's is extended that way only.
  for (std::size_t at = bytes; at > 0; at -= std::min(at, page_bytes())) {
    block[at - 1] = 0;
  }
}

}  // namespace

MemoryLock lock_memory() {
  MemoryLock lock;
  lock.locked = mlockall(MCL_CURRENT) == 0;
  if (!lock.locked) {
    lock.warning = not_locked(errno);
  }
  lock.locked_bytes = status_bytes("VmLck");
  return lock;
}

void unlock_memory() { munlockall(); }

void keep_heap(std::size_t reserve_bytes) {
  // Set one and glibc no longer adapts the other, so both: 32 MB is the largest mmap threshold it
  // takes, and what adapting would come to with images of a few megabytes.
  constexpr std::size_t kMmapThreshold = 32 * kMegabyte;
  const std::size_t reserve = std::min(reserve_bytes, 512 * kMegabyte);
  mallopt(M_MMAP_THRESHOLD, static_cast<int>(kMmapThreshold));
  mallopt(M_TRIM_THRESHOLD, static_cast<int>(reserve + 128 * kMegabyte));
  // M_MMAP_MAX stays: without mmap, blocks of hundreds of megabytes (models at start) would leave
  // holes in the heap that are never given back.
  std::vector<void*> blocks(reserve / kMegabyte + 1);
  for (void*& block : blocks) {
    block = std::malloc(std::min(reserve, kMegabyte));
    auto* bytes = static_cast<volatile char*>(block);
    for (std::size_t at = 0; bytes != nullptr && at < std::min(reserve, kMegabyte);
         at += page_bytes()) {
      bytes[at] = 0;
    }
  }
  for (void* block : blocks) {
    std::free(block);
  }
}

std::size_t prefault_stack(std::size_t bytes) {
  // What the functions called here need themselves.
  constexpr std::size_t kMargin = std::size_t{16} * 1024;
  const std::size_t left = stack_left();
  const std::size_t touched = left > kMargin ? std::min(bytes, left - kMargin) : 0;
  if (touched > 0) {
    touch_stack(touched);
  }
  return touched;
}

PageFaults thread_page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {.minor = static_cast<std::uint64_t>(usage.ru_minflt),
          .major = static_cast<std::uint64_t>(usage.ru_majflt)};
}

}  // namespace topoloc::realtime
