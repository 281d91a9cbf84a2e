// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/latency_histogram.hpp"

#include <random>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

static_assert(std::is_trivially_copyable_v<LatencyHistogram>, "goes through a TripleBuffer");
static_assert(sizeof(LatencyHistogram) < 9000);

TEST(LatencyHistogram, EmptyIsAllZero) {
  const LatencySummary summary = LatencyHistogram().summary();
  EXPECT_EQ(summary.count, 0U);
  EXPECT_EQ(summary.min_ns, 0);
  EXPECT_EQ(summary.mean_ns, 0);
  EXPECT_EQ(summary.p50_ns, 0);
  EXPECT_EQ(summary.max_ns, 0);
}

TEST(LatencyHistogram, SmallDurationsAreExact) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 50; ++i) {
    histogram.record(i);
  }
  EXPECT_EQ(histogram.count(), 50U);
  EXPECT_EQ(histogram.min_ns(), 1);
  EXPECT_EQ(histogram.mean_ns(), 25);
  EXPECT_EQ(histogram.percentile_ns(0.0), 1);
  EXPECT_EQ(histogram.percentile_ns(0.5), 25);
  EXPECT_EQ(histogram.percentile_ns(1.0), 50);
}

TEST(LatencyHistogram, OneDurationIsEveryPercentile) {
  for (std::int64_t duration = 1; duration < std::int64_t{1} << 50; duration = duration * 3 + 1) {
    LatencyHistogram histogram;
    histogram.record(duration);
    EXPECT_EQ(histogram.percentile_ns(0.001), duration);
    EXPECT_EQ(histogram.percentile_ns(0.999), duration);
    EXPECT_EQ(histogram.max_ns(), duration);
  }
}

// Against sorting, over nine orders of magnitude.
TEST(LatencyHistogram, PercentilesAreAtMostAThirtySecondTooLarge) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(0.0, 10.0);
  LatencyHistogram histogram;
  std::vector<std::int64_t> sorted(20'000);
  for (std::int64_t& duration : sorted) {
    duration = std::llround(std::pow(10.0, exponent(random)));
    histogram.record(duration);
  }
  std::sort(sorted.begin(), sorted.end());
  for (const double share : {0.001, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * 20'000.0));
    const std::int64_t exact = sorted[rank - 1];
    EXPECT_GE(histogram.percentile_ns(share), exact) << share;
    EXPECT_LE(histogram.percentile_ns(share), exact + exact / 32) << share;
  }
}

TEST(LatencyHistogram, HugeAndNegativeDurationsAreKeptWithinBounds) {
  LatencyHistogram histogram;
  constexpr std::int64_t kDay = 86'400'000'000'000;
  histogram.record(kDay);
  histogram.record(2 * kDay);
  histogram.record(-5);
  EXPECT_EQ(histogram.count(), 3U);
  EXPECT_EQ(histogram.min_ns(), 0);
  EXPECT_EQ(histogram.max_ns(), 2 * kDay);
  EXPECT_EQ(histogram.percentile_ns(0.3), 0);
  EXPECT_EQ(histogram.percentile_ns(0.5), 2 * kDay) << "too large, never too small";
}

TEST(LatencyHistogram, MergedIsAsIfRecordedTogether) {
  LatencyHistogram together;
  LatencyHistogram a;
  LatencyHistogram b;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t duration = 37 * i * i + 11;
    together.record(duration);
    (i % 3 == 0 ? a : b).record(duration);
  }
  a.merge(b);
  a.merge(LatencyHistogram());
  for (int permille = 0; permille <= 1000; ++permille) {
    EXPECT_EQ(a.percentile_ns(0.001 * permille), together.percentile_ns(0.001 * permille));
  }
  EXPECT_EQ(a.count(), together.count());
  EXPECT_EQ(a.min_ns(), together.min_ns());
  EXPECT_EQ(a.max_ns(), together.max_ns());
  EXPECT_EQ(a.mean_ns(), together.mean_ns());
}

}  // namespace
}  // namespace topoloc::realtime
