// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace topoloc::live {

/// Whether a camera frame's time stamp can be meant.
enum class FrameStamp : std::uint8_t {
  kAccepted,
  kNotMonotonic,  ///< not later than the frame before
  kFuture,        ///< later than its reception
  kTooOld,        ///< older than the estimator's history: nothing to fuse it with
  kClockStep,     ///< the stamps leapt, and it is not yet known whether they stay where they are
};
inline constexpr std::size_t kFrameStamps = 5;
const char* name(FrameStamp stamp);

/// How the camera's time stamps relate to the time of their reception, since the start.
struct FrameTiming {
  std::array<std::uint64_t, kFrameStamps> stamps{};  ///< by FrameStamp
  std::uint64_t steps = 0;                           ///< times that the camera's clock was set
  std::uint64_t late = 0;     ///< accepted, but 0.1 s later than the shortest delay
  double correction_s = 0.0;  ///< added to the stamps to make up for that
  double delay_ms = 0.0;      ///< shortest way from exposure to reception, lately
  double drift_ppm = 0.0;     ///< how that changes: the camera's clock is slow where positive
};

/// Watches the time stamps of camera frames against the time line of everything else.
///
/// A frame can come late, never early: whatever stalls on the way (sender, network, this process)
/// makes the delay from stamp to reception longer for a while, then it is the shortest again. So a
/// long delay says nothing about the clock, and frames that have one are accepted. The camera's
/// clock is suspected only for what no delay explains: stamps that go back or come closer together
/// than the camera takes pictures, or a frame that came sooner than any can. Frames are left out
/// until it is clear whether one stamp was wrong (the stamps go on as before) or the clock was set
/// (they go on from there, and five frames had about the same shortest delay). Then stamps are
/// corrected so that the delay is what it was, since with that the poses were right.
class FrameGate {
 public:
  /// `max_age_ns`: of the estimator's history.
  explicit FrameGate(std::int64_t max_age_ns) : max_age_ns_(max_age_ns) {}

  /// Brings `time_ns` onto the time line of `received_ns`; only frames that are accepted count.
  FrameStamp add(std::int64_t& time_ns, std::int64_t received_ns);

  [[nodiscard]] const FrameTiming& timing() const { return timing_; }

 private:
  struct Frame {
    std::int64_t time_ns = 0;
    std::int64_t received_ns = 0;
    [[nodiscard]] std::int64_t delay_ns() const { return received_ns - time_ns; }
  };
  /// Shortest delay within a stretch of time.
  struct Window {
    std::int64_t from_ns = 0;
    std::int64_t least_ns = 0;
  };
  /// Stamps that no delay explains, and those after them.
  struct Leap {
    Frame first;
    Frame last;
    std::int64_t least_ns = 0;  ///< shortest delay
    int near_least = 0;         ///< frames with about that
    int frames = 0;
  };

  FrameStamp judge(Frame& frame);
  [[nodiscard]] bool is_impossible(const Frame& frame) const;
  [[nodiscard]] bool goes_on_as_before(const Frame& frame) const;
  [[nodiscard]] bool goes_on_from_leap(const Frame& frame) const;
  void follow_leap(const Frame& frame);
  [[nodiscard]] bool is_settled() const;
  bool end_leap(Frame& frame);
  void improve_correction(Frame& frame);
  bool is_ahead(Frame& frame);
  void correct(Frame& frame, std::int64_t step_ns);
  void watch(const Frame& frame);
  void watch_interval(std::int64_t stamp_ns);
  /// How far a stamp is from where the next picture was due, none lost since the last accepted.
  [[nodiscard]] std::int64_t off_beat_ns(const Frame& frame) const;
  /// Shortest delay of the last seconds.
  [[nodiscard]] std::int64_t least_ns() const;
  /// Shortest delay of the last minute.
  [[nodiscard]] std::int64_t least_of_minute_ns() const;

  static constexpr std::size_t kIntervals = 9;
  static constexpr std::size_t kWindows = 12;

  std::int64_t max_age_ns_;
  std::int64_t correction_ns_ = 0;
  std::optional<Frame> last_;                            // accepted
  int since_last_ = 0;                                   // frames that came since, this one too
  std::array<std::int64_t, kIntervals> intervals_ns_{};  // between stamps, as they came
  std::size_t interval_count_ = 0;
  std::optional<std::int64_t> last_stamp_ns_;  // as it came
  std::int64_t period_ns_ = 0;                 // of the camera; 0: not known yet
  std::optional<Leap> leap_;
  int ahead_ = 0;  // stamps later than their reception, one after the other
  std::int64_t ahead_least_ns_ = 0;
  std::int64_t improve_until_ns_ = 0;  // after a correction: whether a shorter delay shows up
  std::int64_t improve_to_ns_ = 0;
  std::optional<Window> window_;
  std::array<Window, kWindows> before_{};  // the windows before that, in turn
  std::size_t before_count_ = 0;
  FrameTiming timing_;
};

}  // namespace topoloc::live
