// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <pthread.h>
#include <string>
#include <vector>

namespace topoloc::realtime {

struct ThreadConfig {
  std::string name;       ///< 1 to 15 characters, as top and perf show it
  int fifo_priority = 0;  ///< 1 to 99: SCHED_FIFO; 0: scheduled as ordinary threads are
  std::vector<int> cpus =
      {};  ///< the only ones it may run on; empty: as the thread that creates it
  std::size_t stack_bytes =
      std::size_t{512} * 1024;  ///< at least 64 kB; all of it is touched beforehand
};

/// A thread whose resources exist before its work begins.
///
/// The constructor creates the thread, which takes on its name, CPUs and priority, touches its
/// stack, and waits; start() lets it go. So: create all threads, lock the memory (their stacks with
/// it), map the map, start. Signals meant for the process (SIGTERM) are left to other threads: they
/// would interrupt its cycle.
///
/// What the system denies does not keep it from running: warnings() says what, one line each, and
/// what to do about it. All functions are for the thread that created it.
class Thread {
 public:
  /// Throws std::invalid_argument if the config is out of range, std::system_error if the system
  /// gives no thread. `entry` must not throw.
  Thread(ThreadConfig config, std::function<void()> entry);
  /// Joins; if it was never started, `entry` is not run. Whatever ends `entry` must have happened.
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

  /// Privileges and CPUs that were asked for and not given; complete once constructed.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  void start();
  /// Waits for the end of `entry`; a thread never started ends without running it.
  void join();

 private:
  enum class Stage : int { kPreparing, kPrepared, kRun, kCancelled };

  static void* enter(void* self);
  void prepare();
  void set_cpus();
  void set_priority();
  void advance(Stage stage);

  ThreadConfig config_;
  std::function<void()> entry_;
  std::vector<std::string> warnings_;
  std::atomic<Stage> stage_{Stage::kPreparing};
  pthread_t handle_{};
  bool joined_ = false;
};

}  // namespace topoloc::realtime
