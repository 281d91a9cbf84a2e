// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/frame_gate.hpp"

#include <algorithm>
#include <cstdlib>

namespace topoloc::live {
namespace {

constexpr std::int64_t kFuture_ns = 5'000'000;        // noise of two clocks
constexpr std::int64_t kLeap_ns = 50'000'000;         // of a stamp against its reception
constexpr std::int64_t kSame_ns = 25'000'000;         // between delays of one clock setting
constexpr int kFramesToBelieve = 5;                   // after a leap
constexpr std::int64_t kWindow_ns = 5'000'000'000;    // a shortest delay is looked for so long
constexpr std::int64_t kPatience_ns = 3'000'000'000;  // for frames that are not late, after a leap

bool alike(std::int64_t a_ns, std::int64_t b_ns) { return std::abs(a_ns - b_ns) <= kSame_ns; }

}  // namespace

const char* name(FrameStamp stamp) {
  switch (stamp) {
    case FrameStamp::kAccepted:
      return "accepted";
    case FrameStamp::kNotMonotonic:
      return "time_not_monotonic";
    case FrameStamp::kFuture:
      return "time_in_future";
    case FrameStamp::kTooOld:
      return "too_old";
    case FrameStamp::kClockStep:
      return "clock_step";
  }
  return "unknown";
}

FrameStamp FrameGate::add(std::int64_t& time_ns, std::int64_t received_ns) {
  watch_interval(time_ns);
  ++since_last_;
  Frame frame{time_ns + correction_ns_, received_ns};
  const FrameStamp stamp = judge(frame);
  time_ns = frame.time_ns;
  ++timing_.stamps[static_cast<std::size_t>(stamp)];
  if (stamp == FrameStamp::kAccepted) {
    watch(frame);
  }
  return stamp;
}

FrameStamp FrameGate::judge(Frame& frame) {
  if (leap_ || is_impossible(frame)) {
    follow_leap(frame);
    if (leap_ && !(is_settled() && end_leap(frame))) {
      return FrameStamp::kClockStep;
    }
  }
  improve_correction(frame);
  if (is_ahead(frame)) {
    return FrameStamp::kFuture;
  }
  if (frame.delay_ns() > max_age_ns_) {
    return FrameStamp::kTooOld;
  }
  if (last_ && frame.time_ns <= last_->time_ns) {
    return FrameStamp::kNotMonotonic;
  }
  return FrameStamp::kAccepted;
}

std::int64_t FrameGate::off_beat_ns(const Frame& frame) const {
  return std::abs(frame.time_ns - last_->time_ns - since_last_ * period_ns_);
}

// What is on the beat can be delayed, but not wrong: frames that waited come all at once.
bool FrameGate::is_impossible(const Frame& frame) const {
  constexpr std::uint64_t kFramesForABeat = 2;
  if (timing_.stamps[static_cast<std::size_t>(FrameStamp::kAccepted)] < kFramesForABeat ||
      period_ns_ == 0 || off_beat_ns(frame) <= kSame_ns) {
    return false;
  }
  const std::int64_t stamps_ns = frame.time_ns - last_->time_ns;
  const std::int64_t receptions_ns = frame.received_ns - last_->received_ns;
  const bool back = stamps_ns < 0;
  const bool too_close = stamps_ns < period_ns_ - kLeap_ns &&
                         receptions_ns - stamps_ns > kLeap_ns &&
                         alike(receptions_ns, since_last_ * period_ns_);
  const bool too_soon = frame.delay_ns() < -kFuture_ns ||
                        (before_count_ > 0 && frame.delay_ns() < least_of_minute_ns() - kLeap_ns);
  return back || too_close || too_soon;
}

// Stamps tell it whatever stalls; where they do not, delays do.
bool FrameGate::goes_on_as_before(const Frame& frame) const {
  if (frame.time_ns <= last_->time_ns || frame.delay_ns() < least_of_minute_ns() - kLeap_ns) {
    return false;
  }
  const std::int64_t here_ns = off_beat_ns(frame);
  const std::int64_t there_ns = std::abs(frame.time_ns - leap_->last.time_ns - period_ns_);
  if (std::abs(here_ns - there_ns) > kSame_ns) {
    return here_ns < there_ns;
  }
  return alike(frame.delay_ns(), least_ns()) || alike(frame.delay_ns(), last_->delay_ns());
}

bool FrameGate::goes_on_from_leap(const Frame& frame) const {
  const std::int64_t stamps_ns = frame.time_ns - leap_->last.time_ns;
  const std::int64_t beats = std::max<std::int64_t>(1, (stamps_ns + period_ns_ / 2) / period_ns_);
  return stamps_ns > 0 && std::abs(frame.delay_ns() - leap_->last.delay_ns()) <= max_age_ns_ &&
         (alike(stamps_ns, beats * period_ns_) || alike(frame.delay_ns(), leap_->last.delay_ns()));
}

void FrameGate::follow_leap(const Frame& frame) {
  if (leap_ && goes_on_as_before(frame)) {
    leap_.reset();
    return;
  }
  if (!leap_ || !goes_on_from_leap(frame)) {
    leap_ = Leap{.first = frame, .last = frame, .least_ns = frame.delay_ns()};
  }
  const std::int64_t delay_ns = frame.delay_ns();
  if (delay_ns < leap_->least_ns - kSame_ns) {
    leap_->near_least = 0;
  }
  leap_->least_ns = std::min(leap_->least_ns, delay_ns);
  leap_->near_least += alike(delay_ns, leap_->least_ns) ? 1 : 0;
  leap_->last = frame;
  ++leap_->frames;
}

bool FrameGate::is_settled() const {
  return leap_->near_least >= kFramesToBelieve ||
         (leap_->frames >= kFramesToBelieve &&
          leap_->last.received_ns - leap_->first.received_ns > kPatience_ns);
}

// Also where the stamps are found to be good.
bool FrameGate::end_leap(Frame& frame) {
  const std::int64_t before_ns = least_ns();
  const std::int64_t step_ns = leap_->least_ns - before_ns;
  leap_.reset();
  if (std::abs(step_ns) > kLeap_ns) {
    correct(frame, step_ns);
    improve_until_ns_ = frame.received_ns + kWindow_ns;
    improve_to_ns_ = before_ns;
  }
  return true;
}

// The frames that a correction was made of may all have been late.
void FrameGate::improve_correction(Frame& frame) {
  if (frame.received_ns > improve_until_ns_ || frame.delay_ns() >= improve_to_ns_) {
    return;
  }
  const std::int64_t better_ns = frame.delay_ns() - improve_to_ns_;
  correction_ns_ += better_ns;
  frame.time_ns += better_ns;
  timing_.correction_s = 1e-9 * static_cast<double>(correction_ns_);
}

bool FrameGate::is_ahead(Frame& frame) {
  if (frame.delay_ns() >= -kFuture_ns) {
    if (frame.delay_ns() > 0) {
      ahead_ = 0;
    }
    return false;
  }
  ahead_least_ns_ = ahead_ == 0 ? frame.delay_ns() : std::min(ahead_least_ns_, frame.delay_ns());
  if (++ahead_ < kFramesToBelieve) {
    return true;
  }
  correct(frame, ahead_least_ns_ - (window_ ? std::max<std::int64_t>(0, least_ns()) : 0));
  ahead_ = 0;
  return false;
}

std::int64_t FrameGate::least_ns() const {
  return before_count_ > 0
             ? std::min(window_->least_ns, before_[(before_count_ - 1) % kWindows].least_ns)
             : window_->least_ns;
}

std::int64_t FrameGate::least_of_minute_ns() const {
  std::int64_t least_ns = window_->least_ns;
  for (std::size_t i = 0; i < std::min(before_count_, kWindows); ++i) {
    least_ns = std::min(least_ns, before_[i].least_ns);
  }
  return least_ns;
}

// Also of stamps that are turned away. The median does not mind pictures that are lost now and
// then, nor a clock that is set.
void FrameGate::watch_interval(std::int64_t stamp_ns) {
  if (last_stamp_ns_ && stamp_ns > *last_stamp_ns_) {
    intervals_ns_[interval_count_++ % kIntervals] = stamp_ns - *last_stamp_ns_;
    const auto count = static_cast<std::ptrdiff_t>(std::min(interval_count_, kIntervals));
    auto sorted = intervals_ns_;
    std::nth_element(sorted.begin(), sorted.begin() + count / 2, sorted.begin() + count);
    period_ns_ = sorted[static_cast<std::size_t>(count / 2)];
  }
  last_stamp_ns_ = stamp_ns;
}

// A positive step takes as much off the delay.
void FrameGate::correct(Frame& frame, std::int64_t step_ns) {
  correction_ns_ += step_ns;
  frame.time_ns += step_ns;
  timing_.correction_s = 1e-9 * static_cast<double>(correction_ns_);
  ++timing_.steps;
}

void FrameGate::watch(const Frame& frame) {
  last_ = frame;
  since_last_ = 0;
  if (!window_) {
    window_ = {frame.received_ns, frame.delay_ns()};
  }
  constexpr std::int64_t kLate_ns = 100'000'000;
  timing_.late += frame.delay_ns() > least_ns() + kLate_ns ? 1 : 0;
  window_->least_ns = std::min(window_->least_ns, frame.delay_ns());
  timing_.delay_ms = 1e-6 * static_cast<double>(window_->least_ns);
  if (frame.received_ns - window_->from_ns < kWindow_ns) {
    return;
  }
  if (before_count_ > 0) {
    constexpr double kSmoothing = 0.2;
    const Window& before = before_[(before_count_ - 1) % kWindows];
    const double ppm = 1e6 * static_cast<double>(window_->least_ns - before.least_ns) /
                       static_cast<double>(window_->from_ns - before.from_ns);
    timing_.drift_ppm += kSmoothing * (ppm - timing_.drift_ppm);
  }
  before_[before_count_++ % kWindows] = *window_;
  window_ = {frame.received_ns, frame.delay_ns()};
}

}  // namespace topoloc::live
