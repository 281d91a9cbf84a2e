// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <linux/capability.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

namespace topoloc::test {

/// Runs `work` in a thread that may neither have real-time priority nor lock memory, as an ordinary
/// user's, whoever runs the tests; the process's limits are as before afterwards.
template <typename Work>
void without_privileges(const Work& work) {
  rlimit priority{};
  rlimit memory{};
  getrlimit(RLIMIT_RTPRIO, &priority);
  getrlimit(RLIMIT_MEMLOCK, &memory);
  const rlimit no_priority{.rlim_cur = 0, .rlim_max = priority.rlim_max};
  const rlimit no_memory{.rlim_cur = 0, .rlim_max = memory.rlim_max};
  setrlimit(RLIMIT_RTPRIO, &no_priority);
  setrlimit(RLIMIT_MEMLOCK, &no_memory);
  // Capabilities are a thread's own: those of the test's thread stay.
  std::thread([&work] {
    __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
    __user_cap_data_struct none[2] = {};
    syscall(SYS_capset, &header, none);
    work();
  }).join();
  setrlimit(RLIMIT_RTPRIO, &priority);
  setrlimit(RLIMIT_MEMLOCK, &memory);
}

}  // namespace topoloc::test
