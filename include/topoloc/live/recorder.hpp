// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/journal.hpp"
#include "topoloc/realtime/spsc_ring.hpp"

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace topoloc::live {

class StopEvent;

/// Writes the journal in a thread of its own.
class Recorder {
 public:
  struct Config {
    std::filesystem::path folder;
    std::size_t max_bytes;
    JournalWriter::Origin origin;
  };

  /// All references outlive this.
  Recorder(Config config, realtime::SpscRing<NumberedMatchSet>& match_sets,
           realtime::SpscRing<RecordedTick>& ticks)
      : config_(std::move(config)), match_sets_(match_sets), ticks_(ticks) {}

  /// Begins the journal; that of the run before is moved. Before run(), in any thread. Returns why
  /// it could not, empty else: then failed(), and nothing will be recorded.
  [[nodiscard]] std::string open();

  /// Until `stop` is set and what was there by then is written. Ends early where the disk is full
  /// or gone: failed(). Ends at once where the journal is not open.
  void run(const StopEvent& stop);

  [[nodiscard]] bool failed() const { return failed_.load(std::memory_order_relaxed); }

 private:
  void write_match_sets();
  void write_all();

  Config config_;
  std::optional<JournalWriter> journal_;
  realtime::SpscRing<NumberedMatchSet>& match_sets_;
  realtime::SpscRing<RecordedTick>& ticks_;
  std::atomic<bool> failed_{false};
};

}  // namespace topoloc::live
