// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/lateness.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::replay {

void Lateness::add(std::int64_t late_ns) {
  late_ns = std::max<std::int64_t>(late_ns, 0);
  ++count_;
  late_count_ += late_ns > kLate_ns ? 1 : 0;
  max_ns_ = std::max(max_ns_, late_ns);
  const auto bin = static_cast<std::size_t>(late_ns / kStep_ns);
  if (bin < bins_.size()) {
    ++bins_[bin];
  }
}

std::int64_t Lateness::quantile_ns(double share) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    seen += bins_[bin];
    if (seen >= wanted && seen > 0) {
      return std::min(max_ns_, (static_cast<std::int64_t>(bin) + 1) * kStep_ns);
    }
  }
  return max_ns_;
}

}  // namespace topoloc::replay
