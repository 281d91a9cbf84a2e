// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "realtime/trap_report.hpp"

#include <array>
#include <cstdlib>
#include <cstring>
#include <execinfo.h>
#include <sys/prctl.h>
#include <unistd.h>

namespace topoloc::realtime::detail {

namespace {

// Not by stdio, whose lock another thread may hold.
void print(const char* text) {
  // Whether it can be written does not matter any more.
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
}

}  // namespace

[[gnu::noinline]] void report_trap(const char* call) {
  std::array<char, 17> thread{};
  prctl(PR_GET_NAME, thread.data());
  print("real-time trap: thread '");
  print(thread.data());
  print("' called ");
  print(call);
  print("() where blocking is forbidden\n");
  std::array<void*, 64> frames{};
  const int count = backtrace(frames.data(), static_cast<int>(frames.size()));
  // From the call on: the first is this function.
  backtrace_symbols_fd(frames.data() + 1, count - 1, STDERR_FILENO);
  print("(c++filt reads the names, addr2line -e PROGRAM the addresses)\n");
  std::abort();
}

void report_missing(const char* call) {
  print("real-time traps: the C library has no ");
  print(call);
  print("()\n");
  std::abort();
}

}  // namespace topoloc::realtime::detail
