// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/can_sender.hpp"
#include "topoloc/replay/drive_part.hpp"
#include "topoloc/replay/lateness.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace topoloc::replay {

/// Keeps real time: the time line of a replay (zero at its start) laid onto the present.
class Pacer {
 public:
  /// `speed` 2: twice as fast as recorded. The replay starts a moment from now, so that whoever
  /// takes part is there.
  explicit Pacer(double speed);

  /// Sleeps until that time, absolutely: a late wake-up does not make the next one late. False if
  /// `stop` was set first (looked at every 50 ms).
  [[nodiscard]] bool wait_until(std::int64_t elapsed_ns, const std::atomic<bool>& stop) const;
  /// How long ago that time was.
  [[nodiscard]] std::int64_t late_ns(std::int64_t elapsed_ns) const;
  /// Unix time of a point of the time line, by the system's clock as it is now.
  [[nodiscard]] std::int64_t unix_ns(std::int64_t elapsed_ns) const;

 private:
  [[nodiscard]] std::int64_t due_ns(std::int64_t elapsed_ns) const;  ///< monotonic clock

  double speed_;
  std::int64_t start_ns_;
};

struct CanPlayed {
  std::uint64_t frames = 0;                                      ///< due, after the faults
  std::array<std::uint64_t, can::kSendVerdictCount> verdicts{};  ///< what became of them
  std::uint64_t queue_waits = 0;  ///< frames that had to wait for room in the interface's queue
  Lateness lateness;              ///< of those sent
};

struct CameraPlayed {
  std::uint64_t images = 0;
  std::uint64_t failed = 0;  ///< not published
  Lateness lateness;
};

using SendFrame = std::function<can::SendVerdict(const can::Frame&)>;
/// An encoded image_t; false if it could not be published.
using PublishImage = std::function<bool(std::span<const std::byte>)>;

/// Plays to the end, or until `stop`. A frame that finds the queue full waits for up to 50 ms.
CanPlayed play_can(CanTrack& track, CanFaults& faults, const SendFrame& send, const Pacer& pacer,
                   const std::atomic<bool>& stop);

/// The same with images. Their stamps become the present: what was exposed as a CAN frame came gets
/// the time at which that frame is due.
CameraPlayed play_camera(CameraTrack& track, CameraFaults& faults, const PublishImage& publish,
                         const Pacer& pacer, const std::atomic<bool>& stop);

}  // namespace topoloc::replay
