// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_times.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::camera {
namespace {

constexpr double kSecond_ns = 1e9;

}  // namespace

ImageTimes::ImageTimes(double fps) : period_ns_(kSecond_ns / fps) {
  if (!(fps > 0.0) || !std::isfinite(period_ns_)) {
    throw std::invalid_argument("images per second: expected a positive number");
  }
}

ImageTimes::ImageTimes(const std::vector<ImageStamp>& stamps) : first_ns_(stamps.at(0).time_ns) {
  elapsed_.reserve(stamps.size());
  for (const ImageStamp& stamp : stamps) {
    elapsed_.push_back(stamp.time_ns - first_ns_);
  }
  constexpr double kSinglePeriod_ns = 0.1 * kSecond_ns;
  period_ns_ = elapsed_.size() < 2 ? kSinglePeriod_ns
                                   : static_cast<double>(elapsed_.back()) /
                                         static_cast<double>(elapsed_.size() - 1);
}

bool ImageTimes::elapsed_ns(std::size_t index, std::int64_t& elapsed_ns) const {
  if (elapsed_.empty()) {
    elapsed_ns = std::llround(period_ns_ * static_cast<double>(index));
    return true;
  }
  if (index >= elapsed_.size()) {
    return false;
  }
  elapsed_ns = elapsed_[index];
  return true;
}

std::int64_t ImageTimes::lap_ns(std::size_t count) const {
  if (elapsed_.empty()) {
    return std::llround(period_ns_ * static_cast<double>(count));
  }
  const std::size_t last = std::min(std::max<std::size_t>(count, 1), elapsed_.size()) - 1;
  return elapsed_[last] + std::llround(period_ns_);
}

}  // namespace topoloc::camera
