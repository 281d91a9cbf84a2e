// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_form.hpp"
#include "topoloc/camera/image_source.hpp"
#include "topoloc/realtime/latency_histogram.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace topoloc::camera {

struct BridgeConfig {
  ImageForm form = ImageForm::kAsTheyCome;
  int jpeg_quality = 90;
  double duration_s = 0.0;  ///< 0: until the source ends or `stop`
};

/// What went out. All that the source gave is published, failed or undecodable.
struct BridgeSummary {
  std::uint64_t published = 0;
  std::uint64_t failed = 0;          ///< LCM did not take it
  std::uint64_t undecodable = 0;     ///< JPEG data that was to be decoded
  std::uint64_t not_increasing = 0;  ///< published with a stamp not later than the one before
  std::uint64_t bytes = 0;
  ImageSize size;  ///< of the last image
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  realtime::LatencyHistogram period;  ///< from stamp to stamp
  realtime::LatencyHistogram delay;   ///< from mid-exposure (by the stamp) to the end of publishing

  /// Images per second, by their stamps; 0 of fewer than two.
  [[nodiscard]] double rate_hz() const;
};

/// Takes an encoded image_t; false if it could not be published.
using PublishMessage = std::function<bool(std::span<const std::byte>)>;

/// Publishes what the source gives until it ends. `progress` is called after every image.
BridgeSummary publish_images(ImageSource& source, const BridgeConfig& config,
                             const PublishMessage& publish, const std::atomic<bool>& stop,
                             const std::function<void(const BridgeSummary&)>& progress = {});

}  // namespace topoloc::camera
