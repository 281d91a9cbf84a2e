// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/time_line.hpp"

namespace topoloc::estimation {

bool TimeLine::goes_on(std::int64_t last_ns, std::int64_t time_ns) const {
  // In unsigned numbers the difference of any two stamps fits.
  return time_ns >= last_ns &&
         static_cast<std::uint64_t>(time_ns) - static_cast<std::uint64_t>(last_ns) <=
             static_cast<std::uint64_t>(max_step_ns_);
}

TimeLine::Verdict TimeLine::add(std::int64_t time_ns) {
  if (!last_ns_ || goes_on(*last_ns_, time_ns)) {
    last_ns_ = time_ns;
    candidates_ = 0;
    return Verdict::kAccepted;
  }
  candidates_ = candidates_ > 0 && goes_on(last_candidate_ns_, time_ns) ? candidates_ + 1 : 1;
  last_candidate_ns_ = time_ns;
  if (candidates_ >= confirming_) {
    last_ns_ = time_ns;
    candidates_ = 0;
    return Verdict::kAcceptedNewLine;
  }
  return time_ns < *last_ns_ ? Verdict::kGoneBack : Verdict::kLeaptAhead;
}

}  // namespace topoloc::estimation
