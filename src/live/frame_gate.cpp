// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/frame_gate.hpp"

#include <algorithm>
#include <cstdlib>

namespace topoloc::live {
namespace {

constexpr std::int64_t kFuture_ns = 5'000'000;      // noise of two clocks
constexpr std::int64_t kLeap_ns = 50'000'000;       // of a stamp against its reception
constexpr std::int64_t kSame_ns = 25'000'000;       // between delays of one clock setting
constexpr int kFramesToBelieve = 5;                 // after a leap
constexpr std::int64_t kWindow_ns = 5'000'000'000;  // a shortest delay is looked for so long

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
  if (!leap_ && leaps(frame)) {
    leap_ = Leap{.delay_ns = frame.delay_ns()};
  }
  if (leap_ && !is_confirmed(frame)) {
    return FrameStamp::kClockStep;
  }
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

// Of the time between two stamps and that between their receptions, the one that is more unlike the
// usual period is the odd one.
bool FrameGate::leaps(const Frame& frame) const {
  if (!last_ || period_ns_ == 0) {
    return false;
  }
  const std::int64_t stamps_ns = frame.time_ns - last_->time_ns;
  const std::int64_t receptions_ns = frame.received_ns - last_->received_ns;
  return std::abs(stamps_ns - receptions_ns) > kLeap_ns &&
         std::abs(stamps_ns - period_ns_) > std::abs(receptions_ns - period_ns_);
}

bool FrameGate::is_confirmed(Frame& frame) {
  const std::int64_t delay_ns = frame.delay_ns();
  // It was a wrong stamp or two, or frames that are all late, as those before were.
  if (alike(delay_ns, least_ns()) || alike(delay_ns, last_->delay_ns())) {
    leap_.reset();
    return true;
  }
  if (!alike(delay_ns, leap_->delay_ns)) {
    leap_ = Leap{.delay_ns = delay_ns};
  }
  leap_->delay_ns = std::min(leap_->delay_ns, delay_ns);
  if (++leap_->frames < kFramesToBelieve) {
    return false;
  }
  const std::int64_t step_ns = leap_->delay_ns - least_ns();
  if (std::abs(step_ns) > kLeap_ns) {
    correct(frame, step_ns);
  }
  leap_.reset();
  return true;
}

bool FrameGate::is_ahead(Frame& frame) {
  if (frame.delay_ns() >= -kFuture_ns) {
    if (frame.delay_ns() > 0) {
      ahead_.reset();
    }
    return false;
  }
  if (!ahead_) {
    ahead_ = Leap{.delay_ns = frame.delay_ns()};
  }
  ahead_->delay_ns = std::min(ahead_->delay_ns, frame.delay_ns());
  if (++ahead_->frames < kFramesToBelieve) {
    return true;
  }
  correct(frame, ahead_->delay_ns);
  ahead_.reset();
  return false;
}

std::int64_t FrameGate::least_ns() const {
  return before_ ? std::min(window_->least_ns, before_->least_ns) : window_->least_ns;
}

// A positive step takes as much off the delay.
void FrameGate::correct(Frame& frame, std::int64_t step_ns) {
  correction_ns_ += step_ns;
  frame.time_ns += step_ns;
  timing_.correction_s = 1e-9 * static_cast<double>(correction_ns_);
  ++timing_.steps;
}

void FrameGate::watch(const Frame& frame) {
  if (last_) {
    constexpr std::int64_t kSmoothing = 8;
    const std::int64_t since_ns = frame.received_ns - last_->received_ns;
    period_ns_ += period_ns_ == 0 ? since_ns : (since_ns - period_ns_) / kSmoothing;
  }
  last_ = frame;
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
  if (before_) {
    constexpr double kSmoothing = 0.2;
    const double ppm = 1e6 * static_cast<double>(window_->least_ns - before_->least_ns) /
                       static_cast<double>(window_->from_ns - before_->from_ns);
    timing_.drift_ppm += kSmoothing * (ppm - timing_.drift_ppm);
  }
  before_ = window_;
  window_ = {frame.received_ns, frame.delay_ns()};
}

}  // namespace topoloc::live
