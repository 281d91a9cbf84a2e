// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <optional>

namespace topoloc::can {

/// Unix time of a CAN controller's own time stamps. Its counter is steadier than the moment at
/// which the kernel sees a frame, but starts anywhere and runs at its own rate. The kernel sees a
/// frame never before, and now and then right after, it was on the bus: so the smallest difference
/// between the two clocks is the one to trust, a little widened as time goes on for their drift.
class HardwareClock {
 public:
  /// `software_ns`: the kernel's stamp of the same frame, Unix time. Never later than that.
  std::int64_t unix_ns(std::int64_t hardware_ns, std::int64_t software_ns) noexcept;

  /// The system clock was set, by so much ahead. What goes back is seen without; a small step ahead
  /// looks like a delay. Frames that the kernel stamped before that may still come.
  void system_clock_set(std::int64_t by_ns) noexcept;

  static constexpr double kMaxDrift = 200e-6;  ///< relative; crystals are better than 100e-6
  /// A greater difference between both is no delay: one of the clocks was set.
  static constexpr std::int64_t kMaxDelay_ns = 50'000'000;
  /// A step that no frame shows for so long is in the offset already: a great one may be seen by a
  /// frame before it is told.
  static constexpr std::int64_t kMaxStepAge_ns = 1'000'000'000;

 private:
  void take_step(std::int64_t hardware_ns, std::int64_t difference_ns) noexcept;

  bool running_ = false;
  std::int64_t offset_ns_ = 0;  ///< Unix time less hardware time
  std::int64_t last_hardware_ns_ = 0;
  std::int64_t step_ns_ = 0;  ///< ahead, of which no frame has been seen yet
  std::optional<std::int64_t>
      step_since_ns_;  ///< hardware time of the first frame after it was told
};

}  // namespace topoloc::can
