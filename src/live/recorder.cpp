// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/recorder.hpp"

#include "live/stop_event.hpp"

#include <exception>

namespace topoloc::live {

std::string Recorder::open() {
  try {
    journal_.emplace(config_.folder, config_.max_bytes, config_.origin);
    return {};
  } catch (const std::exception& e) {  // the vehicle drives on without
    failed_.store(true, std::memory_order_relaxed);
    return e.what();
  }
}

void Recorder::run(const StopEvent& stop) {
  constexpr int kPause_ms = 20;
  if (!journal_) {
    return;
  }
  try {
    bool stopping = false;
    while (!stopping) {
      stopping = stop.wait(kPause_ms);
      write_all();
    }
    journal_->close();
  } catch (const std::exception&) {  // likewise
    failed_.store(true, std::memory_order_relaxed);
  }
}

void Recorder::write_all() {
  while (const RecordedTick* tick = ticks_.read_slot()) {
    // The set that a tick names was recorded before the estimator had it.
    if (tick->input.match_set) {
      write_match_sets();
    }
    journal_->add(tick->input, tick->pose);
    ticks_.commit_read();
  }
  write_match_sets();
}

void Recorder::write_match_sets() {
  while (const NumberedMatchSet* set = match_sets_.read_slot()) {
    journal_->add(*set);
    match_sets_.commit_read();
  }
}

}  // namespace topoloc::live
