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
/// A frame can come late, never early, and the shortest delay of the last seconds is steady as long
/// as the two clocks agree: where it drifts, so do they. Where the stamps leap and the frames go on
/// coming evenly, the camera's clock was set: once five frames agree, their stamps are corrected so
/// that the delay is what it was, since with that the poses were right. A frame that is late for
/// other reasons has a stamp that did not leap.
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
  /// Stamps that leapt.
  struct Leap {
    std::int64_t delay_ns = 0;  ///< shortest since
    int frames = 0;
  };

  FrameStamp judge(Frame& frame);
  [[nodiscard]] bool leaps(const Frame& frame) const;
  bool is_confirmed(Frame& frame);
  bool is_ahead(Frame& frame);
  void correct(Frame& frame, std::int64_t step_ns);
  void watch(const Frame& frame);
  /// Shortest delay of the last seconds.
  [[nodiscard]] std::int64_t least_ns() const;

  std::int64_t max_age_ns_;
  std::int64_t correction_ns_ = 0;
  std::optional<Frame> last_;  // accepted
  std::int64_t period_ns_ = 0;
  std::optional<Leap> leap_;
  std::optional<Leap> ahead_;  ///< stamps later than their reception, one after the other
  std::optional<Window> window_;
  std::optional<Window> before_;  // the window before that
  FrameTiming timing_;
};

}  // namespace topoloc::live
