// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/journal.hpp"
#include "topoloc/realtime/spsc_ring.hpp"

#include <atomic>

namespace topoloc::live {

/// Writes the journal in a thread of its own.
class Recorder {
 public:
  /// All references outlive this.
  Recorder(JournalWriter& journal, realtime::SpscRing<NumberedMatchSet>& match_sets,
           realtime::SpscRing<RecordedTick>& ticks)
      : journal_(journal), match_sets_(match_sets), ticks_(ticks) {}

  /// Until `stop` is set and what was there by then is written. Ends early where the disk is full
  /// or gone: failed().
  void run(const std::atomic<bool>& stop);

  [[nodiscard]] bool failed() const { return failed_.load(std::memory_order_relaxed); }

 private:
  void write_match_sets();
  void write_all();

  JournalWriter& journal_;
  realtime::SpscRing<NumberedMatchSet>& match_sets_;
  realtime::SpscRing<RecordedTick>& ticks_;
  std::atomic<bool> failed_{false};
};

}  // namespace topoloc::live
