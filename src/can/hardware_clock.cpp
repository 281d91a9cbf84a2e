// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/hardware_clock.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::can {

std::int64_t HardwareClock::unix_ns(std::int64_t hardware_ns, std::int64_t software_ns) noexcept {
  const std::int64_t difference_ns = software_ns - hardware_ns;
  const std::int64_t elapsed_ns = hardware_ns - last_hardware_ns_;
  last_hardware_ns_ = hardware_ns;
  if (running_ && elapsed_ns >= 0) {
    const std::int64_t drift_ns = std::llround(kMaxDrift * static_cast<double>(elapsed_ns));
    offset_ns_ += drift_ns;
    take_step(hardware_ns, difference_ns);
    offset_ns_ = std::min(offset_ns_, difference_ns);
  }
  if (!running_ || elapsed_ns < 0 || difference_ns - offset_ns_ > kMaxDelay_ns) {
    offset_ns_ = difference_ns;
    step_ns_ = 0;
  }
  running_ = true;
  return hardware_ns + offset_ns_;
}

void HardwareClock::take_step(std::int64_t hardware_ns, std::int64_t difference_ns) noexcept {
  if (step_ns_ == 0) {
    return;
  }
  if (!step_since_ns_) {
    step_since_ns_ = hardware_ns;
  }
  // Stamped after the step, unless it is nearer to how the clocks were before.
  if (difference_ns - offset_ns_ > step_ns_ / 2) {
    offset_ns_ += step_ns_;
    step_ns_ = 0;
  } else if (hardware_ns - *step_since_ns_ > kMaxStepAge_ns) {
    step_ns_ = 0;
  }
}

void HardwareClock::system_clock_set(std::int64_t by_ns) noexcept {
  step_ns_ = std::max<std::int64_t>(step_ns_ + by_ns, 0);
  step_since_ns_.reset();
}

}  // namespace topoloc::can
