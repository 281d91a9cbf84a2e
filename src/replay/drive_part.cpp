// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/drive_part.hpp"

#include "topoloc/transport/image_view.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

namespace topoloc::replay {
namespace {

constexpr std::int64_t kMaxBack_ns = 1'000'000'000;
constexpr std::int64_t kMaxLeap_ns = 60'000'000'000;

std::int64_t stamp_ns(const transport::LogEvent& event) {
  transport::ImageView image;
  transport::view_image(event.data, image);
  return image.time_us * 1000;
}

}  // namespace

CanLogSummary summarise_can_log(const std::filesystem::path& file, double start_s,
                                double duration_s) {
  CanLogSummary summary;
  can::CandumpReader reader(file);
  can::Frame frame;
  bool any = false;
  std::int64_t from_ns = 0;
  std::int64_t before_ns = 0;
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
  while (reader.next(frame)) {
    if (!any) {
      summary.first_ns = frame.time_ns;
      before_ns = frame.time_ns;
      from_ns = frame.time_ns + std::llround(start_s * 1e9);
      if (std::isfinite(duration_s)) {
        until_ns = from_ns + std::llround(duration_s * 1e9);
      }
      any = true;
    }
    ++summary.frames[std::string(frame.interface())];
    const std::int64_t step_ns = frame.time_ns - before_ns;
    const bool in_part = before_ns >= from_ns && frame.time_ns < until_ns;
    if (in_part && (step_ns < -kMaxBack_ns || step_ns > kMaxLeap_ns)) {
      throw std::runtime_error(fmt::format(
          "{}: the time {} by {:.3f} s at {:.6f} s: a replay needs one time line "
          "(--start-seconds and --duration choose a part)",
          file.string(), step_ns < 0 ? "goes back" : "leaps ahead",
          1e-9 * std::abs(static_cast<double>(step_ns)), 1e-9 * static_cast<double>(before_ns)));
    }
    before_ns = frame.time_ns;
    summary.last_ns = std::max(summary.last_ns, frame.time_ns);
  }
  if (!any || summary.last_ns < from_ns) {
    throw std::runtime_error(
        file.string() + ": " +
        (any ? "the log ends before the start asked for" : "holds no CAN frame"));
  }
  summary.malformed = reader.malformed_count();
  return summary;
}

std::int64_t arrival_ns(const transport::LogEvent& event) {
  constexpr std::int64_t kMaxTransfer_ns = 5'000'000'000;
  const std::int64_t exposed_ns = stamp_ns(event);
  // Compared in microseconds: a damaged stamp may be too large for ns.
  const std::int64_t transfer_us = event.time_us - exposed_ns / 1000;
  const bool plausible = transfer_us >= 0 && transfer_us <= kMaxTransfer_ns / 1000;
  return plausible ? event.time_us * 1000 : exposed_ns;
}

CanTrack::CanTrack(std::filesystem::path file, const DrivePart& part)
    : file_(std::move(file)), part_(part), reader_(std::make_unique<can::CandumpReader>(file_)) {}

bool CanTrack::next(TimedFrame& out) {
  for (;;) {
    if (!reader_->next(out.frame)) {
      if (!part_.loop || !any_in_lap_) {
        return false;
      }
      reader_ = std::make_unique<can::CandumpReader>(file_);
      ++lap_;
      any_in_lap_ = false;
      continue;
    }
    const std::int64_t time_ns = out.frame.time_ns;
    if (time_ns < part_.begin_ns || time_ns >= part_.end_ns) {
      continue;
    }
    any_in_lap_ = true;
    last_elapsed_ns_ = std::max(last_elapsed_ns_, time_ns - part_.begin_ns + lap_ * part_.lap_ns());
    out.elapsed_ns = last_elapsed_ns_;
    return true;
  }
}

CameraTrack::CameraTrack(const drive::FrameLog& log, const DrivePart& part,
                         drive::FrameSelection selection)
    : log_(&log), part_(part), selection_(selection) {}

bool CameraTrack::next(TimedImage& out) {
  for (;; ++index_) {
    if (index_ == log_->size()) {
      if (!part_.loop || !any_in_lap_) {
        return false;
      }
      index_ = 0;
      ++lap_;
      any_in_lap_ = false;
    }
    if (!drive::selected(selection_, index_)) {
      continue;
    }
    const transport::LogEvent event = log_->message(index_);
    const std::int64_t time_ns = arrival_ns(event);
    if (time_ns < part_.begin_ns || time_ns >= part_.end_ns) {
      continue;
    }
    const std::int64_t shift_ns = lap_ * part_.lap_ns() - part_.begin_ns;
    last_elapsed_ns_ = std::max(last_elapsed_ns_, time_ns + shift_ns);
    out = {.elapsed_ns = last_elapsed_ns_,
           .stamp_ns = stamp_ns(event) + shift_ns,
           .message = event.data};
    any_in_lap_ = true;
    ++index_;
    return true;
  }
}

std::span<const std::byte> CameraTrack::message_at(std::int64_t elapsed_ns) const {
  std::int64_t time_ns = elapsed_ns;
  if (part_.loop) {
    time_ns = ((time_ns % part_.lap_ns()) + part_.lap_ns()) % part_.lap_ns();
  }
  time_ns += part_.begin_ns;
  // The log is sorted by mid-exposure; arrivals need not be.
  std::size_t low = 0;
  for (std::size_t high = log_->size(); low < high;) {
    const std::size_t middle = low + (high - low) / 2;
    if (stamp_ns(log_->message(middle)) <= time_ns) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low == 0 ? std::span<const std::byte>{} : log_->message(low - 1).data;
}

}  // namespace topoloc::replay
