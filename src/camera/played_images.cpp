// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/played_images.hpp"

#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/system_clock.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace topoloc::camera {
namespace {

using realtime::MonotonicClock;

constexpr std::int64_t kPatience_ns = 50'000'000;

}  // namespace

PlayedImages::PlayedImages(std::unique_ptr<RecordedImages> images, ImageTimes times,
                           const Config& config, Report report)
    : images_(std::move(images)),
      times_(std::move(times)),
      config_(config),
      report_(std::move(report)),
      start_ns_(MonotonicClock::now_ns()) {
  if (config_.loop && config_.keep_stamps) {
    throw std::invalid_argument("recorded stamps would go back in a loop");
  }
}

Taken PlayedImages::next(image_t& image) {
  if (!elapsed_ns_ && !read()) {
    return Taken::kEnd;
  }
  if (!elapsed_ns_) {
    return Taken::kNothing;
  }
  const std::int64_t due_ns = start_ns_ + *elapsed_ns_;
  const std::int64_t patience_ns = MonotonicClock::now_ns() + kPatience_ns;
  MonotonicClock::sleep_until(std::min(due_ns, patience_ns));
  if (due_ns > patience_ns) {
    return Taken::kNothing;
  }
  std::swap(image, read_);
  const std::int64_t stamp_ns = config_.keep_stamps
                                    ? times_.first_ns() + *elapsed_ns_
                                    : due_ns + realtime::read_system_ahead().ahead_ns;
  image.utime = (stamp_ns + config_.offset_ns) / 1000;
  elapsed_ns_.reset();
  return Taken::kImage;
}

bool PlayedImages::read() {
  const Read outcome = images_->next(read_);
  if (outcome == Read::kEnd) {
    return config_.loop && rewind();
  }
  std::int64_t elapsed_ns = 0;
  const bool has_stamp = times_.elapsed_ns(index_, elapsed_ns);
  ++index_;
  if (!has_stamp) {
    if (without_stamp_++ == 0) {
      report_(images_->place() + ": the file of stamps has no line for it: left out");
    }
  } else if (outcome == Read::kUnreadable) {
    if (unreadable_++ == 0) {
      report_(images_->place() + ": cannot be read: left out");
    }
  } else {
    ++readable_;
    elapsed_ns_ = elapsed_ns;
  }
  return true;
}

bool PlayedImages::rewind() {
  if (readable_ == 0) {
    return false;  // nothing to play, however often
  }
  images_->rewind();
  start_ns_ += times_.lap_ns(index_);
  index_ = 0;
  readable_ = 0;
  return true;
}

std::vector<std::pair<std::string, std::uint64_t>> PlayedImages::losses() const {
  return {{"unreadable", unreadable_}, {"without_stamp", without_stamp_}};
}

}  // namespace topoloc::camera
