// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::live {

/// How much work the matcher puts into a frame, so that hardly one frame in a hundred takes longer
/// than the budget: level 0 is what the configuration asks for, each further one costs less.
///
/// A frame that misses the budget costs credit, one that keeps it earns some: more than one miss in
/// a hundred, or three in a row, lead a level down. A level is left upwards again after a while of
/// frames with time to spare; one that proves too slow is tried again ever more rarely.
class LatencyGovernor {
 public:
  LatencyGovernor(std::int64_t budget_ns, int levels);

  /// Level for the next frame.
  [[nodiscard]] int level() const { return level_; }
  /// Times a level was left downwards.
  [[nodiscard]] std::uint64_t slowdowns() const { return slowdowns_; }
  [[nodiscard]] std::uint64_t missed() const { return missed_; }

  /// Notes how long the last frame took, from when it came in.
  void note(std::int64_t latency_ns);

 private:
  void change_level(int by);

  std::int64_t budget_ns_;
  int last_level_;
  int level_ = 0;
  int misses_in_row_ = 0;
  int frames_ = 0;        // on this level, since the last miss
  int debt_ = 0;          // misses not made up for, in frames to come
  int patience_;          // frames with time to spare before a level up
  bool climbed_ = false;  // the level was reached from below, on trial
  std::uint64_t missed_ = 0;
  std::uint64_t slowdowns_ = 0;
};

}  // namespace topoloc::live
