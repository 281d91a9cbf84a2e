// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_bridge.hpp"

#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/system_clock.hpp"

#include <cmath>
#include <limits>
#include <vector>

namespace topoloc::camera {
namespace {

using realtime::MonotonicClock;

std::int64_t unix_now_us() {
  return (MonotonicClock::now_ns() + realtime::read_system_ahead().ahead_ns) / 1000;
}

void count(const image_t& image, std::size_t bytes, BridgeSummary& summary) {
  if (summary.published == 0) {
    summary.first_us = image.utime;
  } else {
    const std::int64_t period_us = image.utime - summary.last_us;
    summary.not_increasing += period_us <= 0 ? 1 : 0;
    summary.period.record(period_us * 1000);
  }
  summary.last_us = image.utime;
  summary.size = {.width_px = image.width, .height_px = image.height};
  summary.bytes += bytes;
  ++summary.published;
  summary.delay.record((unix_now_us() - image.utime) * 1000);
}

}  // namespace

double BridgeSummary::rate_hz() const {
  return published < 2 || last_us <= first_us
             ? 0.0
             : 1e6 * static_cast<double>(published - 1) / static_cast<double>(last_us - first_us);
}

BridgeSummary publish_images(ImageSource& source, const BridgeConfig& config,
                             const PublishMessage& publish, const std::atomic<bool>& stop,
                             const std::function<void(const BridgeSummary&)>& progress) {
  BridgeSummary summary;
  const std::int64_t end_ns = config.duration_s > 0.0
                                  ? MonotonicClock::now_ns() + std::llround(config.duration_s * 1e9)
                                  : std::numeric_limits<std::int64_t>::max();
  image_t image{};
  std::vector<std::byte> message;  // grows to the largest image, then stays
  while (!stop && MonotonicClock::now_ns() < end_ns) {
    const Taken taken = source.next(image);
    if (taken == Taken::kEnd) {
      break;
    }
    if (taken == Taken::kNothing) {
      continue;
    }
    if (!convert(image, config.form, config.jpeg_quality)) {
      ++summary.undecodable;
      continue;
    }
    message.resize(static_cast<std::size_t>(image.getEncodedSize()));
    image.encode(message.data(), 0, static_cast<int>(message.size()));
    if (publish(message)) {
      count(image, message.size(), summary);
    } else {
      ++summary.failed;
    }
    if (progress) {
      progress(summary);
    }
  }
  return summary;
}

}  // namespace topoloc::camera
