// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/player.hpp"

#include "topoloc/transport/image_view.hpp"

#include "replay/black_image.hpp"

#include <chrono>
#include <thread>
#include <vector>

namespace topoloc::replay {
namespace {

using can::SendVerdict;

/// Sends; a full queue empties at the bus's pace.
SendVerdict send_patiently(const SendFrame& send, const can::Frame& frame,
                           std::uint64_t& queue_waits) {
  constexpr auto kNap = std::chrono::microseconds(200);
  constexpr int kMaxNaps = 250;
  SendVerdict verdict = send(frame);
  queue_waits += verdict == SendVerdict::kQueueFull ? 1 : 0;
  for (int naps = 0; verdict == SendVerdict::kQueueFull && naps < kMaxNaps; ++naps) {
    std::this_thread::sleep_for(kNap);
    verdict = send(frame);
  }
  return verdict;
}

/// Runs a track through its faults and hands out, at their times, what comes of it.
template <typename Item, typename Track, typename Faults, typename Play>
void play(Track& track, Faults& faults, const Pacer& pacer, const std::atomic<bool>& stop,
          const Play& play_one) {
  std::vector<Item> due;
  Item item;
  for (bool more = true; more;) {
    more = track.next(item);
    due.clear();
    more ? faults.push(item, due) : faults.finish(due);
    for (const Item& next : due) {
      if (!pacer.wait_until(next.elapsed_ns, stop)) {
        return;
      }
      play_one(next);
    }
  }
}

}  // namespace

CanPlayed play_can(CanTrack& track, CanFaults& faults, const SendFrame& send, const Pacer& pacer,
                   const std::atomic<bool>& stop) {
  CanPlayed played;
  play<TimedFrame>(track, faults, pacer, stop, [&](const TimedFrame& next) {
    ++played.frames;
    const SendVerdict verdict = send_patiently(send, next.frame, played.queue_waits);
    ++played.verdicts[static_cast<std::size_t>(verdict)];
    if (verdict == SendVerdict::kSent) {
      played.lateness.add(pacer.late_ns(next.elapsed_ns));
    }
  });
  return played;
}

CameraPlayed play_camera(CameraTrack& track, CameraFaults& faults, const PublishImage& publish,
                         const Pacer& pacer, const std::atomic<bool>& stop) {
  CameraPlayed played;
  std::vector<std::byte> message;
  play<TimedImage>(track, faults, pacer, stop, [&](const TimedImage& next) {
    message.assign(next.message.begin(), next.message.end());
    if (next.black) {
      message = black_image(next.message);
    }
    transport::set_image_time(message, pacer.unix_ns(next.stamp_ns) / 1000);
    ++played.images;
    if (publish(message)) {
      played.lateness.add(pacer.late_ns(next.elapsed_ns));
    } else {
      ++played.failed;
    }
  });
  return played;
}

}  // namespace topoloc::replay
