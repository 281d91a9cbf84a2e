// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/estimator.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace topoloc::live {

/// A sample comes with at least one frame, so there are never more of them.
inline constexpr std::size_t kMaxFramesPerTick = 64;

/// A match set on its way from the matcher to the estimator. Numbers count up by one.
struct NumberedMatchSet {
  std::uint64_t number = 0;
  estimation::MapMatchSet set;
};

/// Everything that one tick of the estimator took in: whoever feeds an estimator with the same
/// configuration the same ticks gets the same estimates, bit for bit.
struct TickInput {
  std::uint64_t tick = 0;             ///< number; missed ticks are counted
  std::int64_t now_ns = 0;            ///< on the HostClock's line, as all times here
  std::int64_t system_offset_ns = 0;  ///< HostClock's
  std::uint64_t lost_before = 0;      ///< ticks that the recorder was too slow for
  std::optional<estimation::InitialPose> initial_pose;
  std::optional<std::uint64_t> match_set;  ///< its number
  std::size_t imu_count = 0;
  std::size_t speed_count = 0;
  std::array<estimation::ImuSample, kMaxFramesPerTick> imu{};
  std::array<estimation::SpeedSample, kMaxFramesPerTick> speed{};
};

/// A tick for the journal.
struct RecordedTick {
  TickInput input;
  /// Where the vehicle was after it, where the filter knew: to start from in the middle of a run.
  std::optional<estimation::InitialPose> pose;
};

/// What came out of it.
struct TickOutput {
  std::uint64_t tick = 0;
  std::int64_t now_ns = 0;
  std::int64_t system_offset_ns = 0;
  estimation::Estimate estimate;
  estimation::ImuSample imu;      ///< newest
  estimation::SpeedSample speed;  ///< newest, whether the filter takes it or not
};

/// An estimator that takes ticks. What batch and the live process share: the thread around it and
/// where the ticks come from make no difference.
class TickRunner {
 public:
  explicit TickRunner(const estimation::EstimatorConfig& config);

  /// `set`: the one that input.match_set names, null without. Neither allocates nor throws.
  const TickOutput& run(const TickInput& input, const estimation::MapMatchSet* set);

  [[nodiscard]] const estimation::Estimator& estimator() const { return estimator_; }

 private:
  estimation::Estimator estimator_;
  TickOutput output_;
};

}  // namespace topoloc::live
