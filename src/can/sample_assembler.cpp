// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/sample_assembler.hpp"

#include <algorithm>

namespace topoloc::can {
namespace {

/// Counters wrap: equal ones so far apart are not of the same sample (a 4-bit counter at 100 Hz
/// comes round every 160 ms).
constexpr std::int64_t kMaxCounterAge_ns = 100'000'000;

/// So many samples in a row make a new time line.
constexpr unsigned kConfirmingSamples = 5;

}  // namespace

void SampleAssembler::configure(std::size_t part_count, bool by_counter,
                                std::int64_t tolerance_ns) {
  part_count_ = part_count;
  by_counter_ = by_counter;
  tolerance_ns_ = tolerance_ns;
  time_line_ = TimeLine(kConfirmingSamples * static_cast<unsigned>(part_count));
}

std::size_t SampleAssembler::waiting() const {
  const auto count =
      std::ranges::count_if(waiting_, [](const Waiting& part) { return part.fresh; });
  return static_cast<std::size_t>(count);
}

bool SampleAssembler::belong_together(const Waiting& a, const Waiting& b) const {
  const std::int64_t apart_ns = a.time_ns < b.time_ns ? b.time_ns - a.time_ns  //
                                                      : a.time_ns - b.time_ns;
  return by_counter_ ? a.counter == b.counter && apart_ns <= kMaxCounterAge_ns
                     : apart_ns <= tolerance_ns_;
}

SampleAssembler::Result SampleAssembler::add(std::size_t part, std::int64_t time_ns,
                                             std::uint64_t counter, const SampleValues& values) {
  Result result;
  result.time = time_line_.add(time_ns);
  if (result.time == TimeLine::Verdict::kGoneBack ||
      result.time == TimeLine::Verdict::kLeaptAhead) {
    return result;
  }
  if (result.time == TimeLine::Verdict::kAcceptedNewLine) {  // nothing waits for the old time
    for (Waiting& waiting : waiting_) {
      result.unpaired += waiting.fresh ? 1 : 0;
      waiting.fresh = false;
    }
  }
  Waiting& arrived = waiting_[part];
  if (arrived.fresh) {
    ++result.unpaired;
  }
  arrived = {true, time_ns, counter};
  values_ = values;

  result.complete = true;
  for (std::size_t i = 0; i < part_count_; ++i) {
    Waiting& other = waiting_[i];
    if (other.fresh && !belong_together(arrived, other)) {
      other.fresh = false;
      ++result.unpaired;
    }
    result.complete = result.complete && other.fresh;
  }
  if (result.complete) {
    std::for_each_n(waiting_.begin(), part_count_, [](Waiting& w) { w.fresh = false; });
  }
  return result;
}

}  // namespace topoloc::can
