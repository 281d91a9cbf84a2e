// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/latency_governor.hpp"

#include <algorithm>

namespace topoloc::live {
namespace {

constexpr int kFramesPerMiss = 100;   // the 99th percentile is to be in the budget
constexpr int kMissesInRow = 3;       // more: it is not chance
constexpr int kPatience = 200;        // frames, some 20 s
constexpr int kMaxPatience = 20'000;  // half an hour
constexpr double kToSpare = 0.6;      // share of the budget

}  // namespace

LatencyGovernor::LatencyGovernor(std::int64_t budget_ns, int levels)
    : budget_ns_(budget_ns), last_level_(levels - 1), patience_(kPatience) {}

void LatencyGovernor::note(std::int64_t latency_ns) {
  if (latency_ns > budget_ns_) {
    ++missed_;
    ++misses_in_row_;
    frames_ = 0;
    debt_ = std::min(debt_ + kFramesPerMiss, 2 * kFramesPerMiss);
    if (level_ < last_level_ && (misses_in_row_ >= kMissesInRow || debt_ > kFramesPerMiss)) {
      patience_ = climbed_ ? std::min(2 * patience_, kMaxPatience) : patience_;
      ++slowdowns_;
      change_level(+1);
    }
    return;
  }
  misses_in_row_ = 0;
  debt_ = std::max(0, debt_ - 1);
  const bool to_spare =
      static_cast<double>(latency_ns) <= kToSpare * static_cast<double>(budget_ns_);
  frames_ = to_spare ? frames_ + 1 : 0;
  if (frames_ < patience_) {
    return;
  }
  if (climbed_) {  // the level has passed its trial
    climbed_ = false;
    patience_ = kPatience;
  }
  if (level_ > 0) {
    change_level(-1);
  }
}

void LatencyGovernor::change_level(int by) {
  level_ += by;
  climbed_ = by < 0;
  misses_in_row_ = 0;
  frames_ = 0;
  debt_ = 0;
}

}  // namespace topoloc::live
