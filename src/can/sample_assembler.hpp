// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/time_line.hpp"

#include "can/signal_part.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace topoloc::can {

using estimation::TimeLine;

/// Puts a sample together from the parts that arrive in separate frames. A part waits until all
/// others that belong to it are there; one that a newer, unrelated part overtakes is dropped.
class SampleAssembler {
 public:
  struct Result {
    bool complete = false;                                  ///< values() is a whole sample
    TimeLine::Verdict time = TimeLine::Verdict::kAccepted;  ///< not believed: not taken
    unsigned unpaired = 0;                                  ///< waiting parts dropped
  };

  /// Parts belong together if their counters agree (`by_counter`), else if they are no further
  /// apart than the tolerance.
  void configure(std::size_t part_count, bool by_counter, std::int64_t tolerance_ns);

  Result add(std::size_t part, std::int64_t time_ns, std::uint64_t counter,
             const SampleValues& values);

  [[nodiscard]] std::size_t part_count() const { return part_count_; }
  /// Parts that have arrived and are in no sample yet.
  [[nodiscard]] std::size_t waiting() const;
  [[nodiscard]] std::int64_t time_ns(std::size_t part) const { return waiting_[part].time_ns; }
  /// Slots of the parts that have arrived; reading a part starts from them.
  [[nodiscard]] const SampleValues& values() const { return values_; }

 private:
  struct Waiting {
    bool fresh = false;  ///< arrived, and in no sample yet
    std::int64_t time_ns = 0;
    std::uint64_t counter = 0;
  };
  [[nodiscard]] bool belong_together(const Waiting& a, const Waiting& b) const;

  std::size_t part_count_ = 0;
  bool by_counter_ = false;
  std::int64_t tolerance_ns_ = 0;
  TimeLine time_line_;
  std::array<Waiting, kMaxSampleValues> waiting_{};
  SampleValues values_{};
};

}  // namespace topoloc::can
