// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <string>
#include <unistd.h>
#include <utility>

#include <fmt/core.h>

namespace topoloc::apps {

/// Progress with time left, on stderr: a bar redrawn in place on a terminal, else at most a line
/// every ten per cent. Thread-safe.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label)
      : label_(std::move(label)), on_terminal_(isatty(STDERR_FILENO) == 1) {}
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar() {
    if (on_terminal_ && drawn_permille_ >= 0 && drawn_permille_ < kDone) {
      fmt::print(stderr, "\n");
    }
  }

  /// `share` done, 0 to 1; a step back is not shown.
  void update(double share) {
    const std::scoped_lock lock(mutex_);
    const int permille = static_cast<int>(kDone * std::clamp(share, 0.0, 1.0));
    const int step = on_terminal_ ? 5 : 100;
    if (drawn_permille_ >= 0 && permille / step <= drawn_permille_ / step) {
      return;
    }
    drawn_permille_ = permille;
    const double elapsed_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const std::string left =
        permille == kDone || (permille > 0 && elapsed_s > kTells_s)
            ? fmt::format("{:.0f} s left", elapsed_s * (kDone - permille) / permille)
            : std::string("starting");
    if (on_terminal_) {
      constexpr int kWidth = 40;
      const int filled = permille * kWidth / kDone;
      fmt::print(stderr, "\r{} [{}{}] {:3d} %  {:<14}{}", label_, std::string(filled, '#'),
                 std::string(kWidth - filled, '.'), permille / 10, left,
                 permille == kDone ? "\n" : "");
    } else {
      fmt::print(stderr, "{}: {:3d} %, {}\n", label_, permille / 10, left);
    }
  }

 private:
  static constexpr int kDone = 1000;
  static constexpr double kTells_s = 0.5;  ///< before, the time so far says nothing

  std::string label_;
  bool on_terminal_;
  int drawn_permille_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
};

}  // namespace topoloc::apps
