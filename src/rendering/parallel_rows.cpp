// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/parallel_rows.hpp"

#include "topoloc/realtime/usable_cpus.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace topoloc::rendering {

void parallel_rows(int count, int threads, const std::function<void(int)>& row) {
  const int used = std::min(threads > 0 ? threads : realtime::usable_cpus(), std::max(count, 1));
  std::atomic<int> next = 0;
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    try {
      for (int i = next++; i < count; i = next++) {
        row(i);
      }
    } catch (...) {
      next = count;
      const std::scoped_lock lock(failure_mutex);
      failure = failure ? failure : std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int i = 1; i < used; ++i) {
      helpers.emplace_back(work);
    }
    work();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace topoloc::rendering
