// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "live/cpu_affinity.hpp"

#include <cstddef>
#include <sched.h>

namespace topoloc::live {

void keep_off_cpu(int cpu) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  if (sched_getaffinity(0, sizeof(cpus), &cpus) != 0) {
    return;
  }
  CPU_CLR(static_cast<std::size_t>(cpu), &cpus);
  if (CPU_COUNT(&cpus) > 0) {
    sched_setaffinity(0, sizeof(cpus), &cpus);
  }
}

}  // namespace topoloc::live
