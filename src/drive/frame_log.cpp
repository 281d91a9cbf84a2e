// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/frame_log.hpp"

#include "topoloc/drive/image_decoding.hpp"

#include <stdexcept>

namespace topoloc::drive {

std::string_view name(FrameReject reason) {
  switch (reason) {
    case FrameReject::kBadMessage:
      return "bad image message";
    case FrameReject::kWrongSize:
      return "image of another size";
    case FrameReject::kNonMonotonicTime:
      return "image time not increasing";
    case FrameReject::kUndecodable:
      return "undecodable image";
  }
  return "unknown";
}

FrameLog::FrameLog(const std::filesystem::path& file, std::string_view channel, cv::Size size,
                   std::int64_t time_offset_ns)
    : file_(file), log_(file), size_(size) {
  for (const std::size_t event : log_.events_on(channel)) {
    transport::ImageView image;
    const transport::ImageVerdict verdict = transport::view_image(log_.event(event).data, image);
    constexpr std::int64_t kLatest_us = 4'000'000'000'000'000;  // year 2096; no overflow in ns
    if (verdict != transport::ImageVerdict::kOk || image.time_us <= 0 ||
        image.time_us > kLatest_us) {
      reject(FrameReject::kBadMessage, event,
             verdict == transport::ImageVerdict::kOk ? "absurd time" : transport::name(verdict));
      continue;
    }
    if (image.width_px != size.width || image.height_px != size.height) {
      reject(FrameReject::kWrongSize, event,
             std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
                 ", calibration says " + std::to_string(size.width) + "x" +
                 std::to_string(size.height));
      continue;
    }
    const std::int64_t time_ns = image.time_us * 1000 + time_offset_ns;
    if (!frames_.empty() && time_ns <= frames_.back().time_ns) {
      reject(FrameReject::kNonMonotonicTime, event, "");
      continue;
    }
    frames_.push_back({time_ns, event});
  }
  if (frames_.empty()) {
    std::string found;
    for (const std::string& other : log_.channels()) {
      found += (found.empty() ? "" : ", ") + other;
    }
    throw std::runtime_error(file_.string() + ": no usable image on channel " +
                             std::string(channel) +
                             " (channels in the log: " + (found.empty() ? "none" : found) + ")" +
                             (first_error_.empty() ? "" : "; " + first_error_));
  }
}

cv::Mat FrameLog::grey(std::size_t index) {
  const std::size_t event = frames_.at(index).event;
  transport::ImageView image;
  transport::view_image(log_.event(event).data, image);
  cv::Mat grey;
  if (!decode_grey(image, size_, grey)) {
    reject(FrameReject::kUndecodable, event, "JPEG data does not decode to the stated size");
    return {};
  }
  return grey;
}

std::map<std::string, std::uint64_t> FrameLog::rejected() const {
  std::map<std::string, std::uint64_t> counts;
  for (std::size_t i = 0; i < kFrameRejectCount; ++i) {
    if (rejected_[i] > 0) {
      counts[std::string(name(static_cast<FrameReject>(i)))] = rejected_[i];
    }
  }
  return counts;
}

void FrameLog::reject(FrameReject reason, std::size_t event, std::string_view what) {
  ++rejected_[static_cast<std::size_t>(reason)];
  if (first_error_.empty()) {
    first_error_ = file_.string() + ": event " + std::to_string(event) + ": " +
                   std::string(name(reason)) + (what.empty() ? "" : ": " + std::string(what));
  }
}

}  // namespace topoloc::drive
