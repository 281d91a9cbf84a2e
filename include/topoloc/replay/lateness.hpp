// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace topoloc::replay {

/// How late things were done, as a histogram: memory does not grow with the length of a replay.
class Lateness {
 public:
  static constexpr std::int64_t kStep_ns = 10'000;
  static constexpr std::int64_t kLate_ns = 5'000'000;  ///< later than that is counted as late

  /// Negative: early, counts as zero.
  void add(std::int64_t late_ns);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::uint64_t late_count() const { return late_count_; }
  [[nodiscard]] std::int64_t max_ns() const { return max_ns_; }
  /// Smallest time within which this share (0 to 1) was done; to kStep_ns up to 100 ms, beyond that
  /// the maximum. Zero of nothing.
  [[nodiscard]] std::int64_t quantile_ns(double share) const;

 private:
  std::array<std::uint64_t, 10'000> bins_{};
  std::uint64_t count_ = 0;
  std::uint64_t late_count_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace topoloc::replay
