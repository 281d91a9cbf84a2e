// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

namespace topoloc::realtime {

/// CPUs that the calling thread may run on, at least 1. std::thread::hardware_concurrency() counts
/// the machine's with some C libraries (Debian 12's), whatever taskset or a container allows.
int usable_cpus();

}  // namespace topoloc::realtime
