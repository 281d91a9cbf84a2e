// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace topoloc::realtime {

/// What one wants to know of a histogram; all zero when nothing was recorded.
struct LatencySummary {
  std::uint64_t count = 0;
  std::int64_t min_ns = 0;
  std::int64_t mean_ns = 0;
  std::int64_t p50_ns = 0;
  std::int64_t p99_ns = 0;
  std::int64_t p999_ns = 0;
  std::int64_t max_ns = 0;
};

/// Histogram of durations in nanoseconds: 8 kB, recording takes the same short time always.
///
/// Log-linear: below 32 ns every nanosecond has its bucket, above it every octave has 32, so a
/// percentile is at most 1/32 too large, and never too small. Durations from 2^36 ns (69 s) on
/// share the last bucket with those just below; minimum, maximum and sum are exact.
///
/// One thread at a time. It is trivially copyable: to let another thread see it, copy it into a
/// TripleBuffer.
class LatencyHistogram {
 public:
  /// Negative durations (there are none on a monotonic clock) count as zero.
  void record(std::int64_t duration_ns) {
    const std::int64_t duration = std::max<std::int64_t>(duration_ns, 0);
    ++buckets_[bucket(duration)];
    ++count_;
    sum_ns_ += duration;
    min_ns_ = std::min(min_ns_, duration);
    max_ns_ = std::max(max_ns_, duration);
  }

  /// Adds all that `other` recorded.
  void merge(const LatencyHistogram& other) {
    for (std::size_t i = 0; i < kBuckets; ++i) {
      buckets_[i] += other.buckets_[i];
    }
    count_ += other.count_;
    sum_ns_ += other.sum_ns_;
    min_ns_ = std::min(min_ns_, other.min_ns_);
    max_ns_ = std::max(max_ns_, other.max_ns_);
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::int64_t min_ns() const { return count_ == 0 ? 0 : min_ns_; }
  [[nodiscard]] std::int64_t max_ns() const { return max_ns_; }
  [[nodiscard]] std::int64_t mean_ns() const {
    return count_ == 0 ? 0 : sum_ns_ / static_cast<std::int64_t>(count_);
  }

  /// The smallest duration that `share` (0 to 1) of all do not exceed, up to the bucket's width;
  /// zero when nothing was recorded.
  [[nodiscard]] std::int64_t percentile_ns(double share) const {
    if (count_ == 0) {
      return 0;
    }
    const double wanted = std::ceil(std::clamp(share, 0.0, 1.0) * static_cast<double>(count_));
    const std::uint64_t rank = std::max<std::uint64_t>(static_cast<std::uint64_t>(wanted), 1);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i + 1 < kBuckets; ++i) {
      seen += buckets_[i];
      if (seen >= rank) {
        return std::clamp(last_of(i), min_ns_, max_ns_);
      }
    }
    return max_ns_;
  }

  [[nodiscard]] LatencySummary summary() const {
    return {.count = count_,
            .min_ns = min_ns(),
            .mean_ns = mean_ns(),
            .p50_ns = percentile_ns(0.5),
            .p99_ns = percentile_ns(0.99),
            .p999_ns = percentile_ns(0.999),
            .max_ns = max_ns_};
  }

 private:
  static constexpr int kSubBits = 5;
  static constexpr std::size_t kSub = std::size_t{1} << kSubBits;
  static constexpr int kTopBit = 35;
  static constexpr std::size_t kBuckets = static_cast<std::size_t>(kTopBit - kSubBits + 2) * kSub;

  static constexpr std::size_t bucket(std::int64_t duration_ns) {
    const auto value = static_cast<std::uint64_t>(duration_ns);
    if (value < kSub) {
      return static_cast<std::size_t>(value);
    }
    const int octave = static_cast<int>(std::bit_width(value)) - 1 - kSubBits;
    // The leading kSubBits + 1 bits: from kSub to 2 kSub - 1.
    const std::size_t mantissa = static_cast<std::size_t>(value >> octave);
    return std::min(static_cast<std::size_t>(octave) * kSub + mantissa, kBuckets - 1);
  }

  /// Largest duration that falls into a bucket.
  static constexpr std::int64_t last_of(std::size_t i) {
    if (i < kSub) {
      return static_cast<std::int64_t>(i);
    }
    const std::size_t octave = i / kSub - 1;
    return static_cast<std::int64_t>(((i - octave * kSub + 1) << octave) - 1);
  }

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::int64_t sum_ns_ = 0;
  std::int64_t min_ns_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t max_ns_ = 0;
};

}  // namespace topoloc::realtime
