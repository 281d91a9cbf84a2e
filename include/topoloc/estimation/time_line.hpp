// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <optional>

namespace topoloc::estimation {

/// Which time stamps of a sensor's frames to believe. Stamps may stand still and move on; one that
/// goes back or leaps ahead is believed only once several in a row agree with each other. So one
/// wrong stamp costs its own frame, and a clock that was set costs a few.
class TimeLine {
 public:
  enum class Verdict : std::uint8_t {
    kAccepted,
    kAcceptedNewLine,  ///< the clock was set: this stamp is the first of another time line
    kGoneBack,         ///< not believed
    kLeaptAhead,       ///< not believed
  };
  static constexpr std::int64_t kMaxStep_ns = 5'000'000'000;

  /// `confirming`: stamps in a row that make a new time line. `max_step_ns`: more is a leap.
  explicit TimeLine(unsigned confirming = 1, std::int64_t max_step_ns = kMaxStep_ns)
      : confirming_(confirming), max_step_ns_(max_step_ns) {}

  Verdict add(std::int64_t time_ns);

 private:
  [[nodiscard]] bool goes_on(std::int64_t last_ns, std::int64_t time_ns) const;

  unsigned confirming_;
  std::int64_t max_step_ns_;
  std::optional<std::int64_t> last_ns_;
  unsigned candidates_ = 0;  ///< stamps in a row that agree on another time line
  std::int64_t last_candidate_ns_ = 0;
};

}  // namespace topoloc::estimation
