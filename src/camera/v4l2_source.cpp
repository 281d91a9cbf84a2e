// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/v4l2_source.hpp"

#include <algorithm>
#include <utility>

#include <fmt/core.h>

namespace topoloc::camera {
namespace {

constexpr int kPatience_ms = 50;
constexpr std::int64_t kRetry_ns = 500'000'000;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

V4l2Source::V4l2Source(VideoCalls& calls, const CameraRequest& request, Report report)
    : calls_(calls), request_(request), report_(std::move(report)) {
  open();
  for (const std::string& warning : camera_->warnings()) {
    report_("warning: " + warning);
  }
  // What comes back has to be the same: receivers know one size only.
  request_.width_px = mode_.size.width_px;
  request_.height_px = mode_.size.height_px;
  request_.layout = mode_.layout;
}

void V4l2Source::open() {
  camera_ = std::make_unique<V4l2Camera>(calls_, request_);
  mode_ = camera_->mode();
  last_image_ns_ = calls_.now_ns();
}

Taken V4l2Source::next(image_t& image) {
  if (camera_ == nullptr) {
    reopen();
    return Taken::kNothing;
  }
  Capture captured = Capture::kTimeout;
  try {
    captured = camera_->capture(image, kPatience_ms);
  } catch (const CameraError& e) {
    close(e.what());
    return Taken::kNothing;
  }
  if (captured == Capture::kDamaged && damaged_++ == 0) {
    report_(request_.device + ": a damaged image; left out, as all that follow");
  }
  if (captured == Capture::kBadStamp && bad_stamps_++ == 0) {
    report_(request_.device +
            ": an image whose time stamp cannot be; left out, as all that follow (if that is most "
            "of them: --stamp-source arrival)");
  }
  if (captured != Capture::kTimeout) {
    last_image_ns_ = calls_.now_ns();
  } else if (is_stuck()) {
    close(fmt::format("{}: no image for {:.1f} s", request_.device,
                      1e-9 * static_cast<double>(calls_.now_ns() - last_image_ns_)));
  }
  return captured == Capture::kImage ? Taken::kImage : Taken::kNothing;
}

bool V4l2Source::is_stuck() const {
  constexpr std::int64_t kLeast_ns = 2 * kSecond_ns;
  constexpr double kPeriods = 5.0;
  const auto periods_ns =
      mode_.fps > 0.0 ? static_cast<std::int64_t>(kPeriods * kSecond_ns / mode_.fps) : 0;
  return calls_.now_ns() - last_image_ns_ > std::max(kLeast_ns, periods_ns);
}

void V4l2Source::close(const std::string& why) {
  dropped_ += camera_->dropped();
  stamped_on_arrival_ += camera_->stamped_on_arrival();
  camera_.reset();
  ++interruptions_;
  retry_ns_ = calls_.now_ns();
  last_problem_.clear();
  report_(why + "; waiting for it to come back");
}

void V4l2Source::reopen() {
  if (calls_.now_ns() < retry_ns_) {
    calls_.sleep_ms(kPatience_ms);
    return;
  }
  retry_ns_ = calls_.now_ns() + kRetry_ns;
  try {
    open();
    report_(request_.device + ": is back");
  } catch (const CameraError& e) {
    if (last_problem_ != e.what()) {  // once, not twice a second
      last_problem_ = e.what();
      report_("still waiting: " + last_problem_);
    }
  }
}

std::vector<std::pair<std::string, std::uint64_t>> V4l2Source::losses() const {
  const bool open = camera_ != nullptr;
  return {{"dropped", dropped_ + (open ? camera_->dropped() : 0)},
          {"damaged", damaged_},
          {"bad_stamp", bad_stamps_},
          {"interruptions", interruptions_},
          {"stamped_on_arrival", stamped_on_arrival_ + (open ? camera_->stamped_on_arrival() : 0)}};
}

}  // namespace topoloc::camera
