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

/// Runs a track through its faults: what comes of it is prepared ahead and sent at its time.
template <typename Item, typename Track, typename Faults, typename Prepare, typename Send>
void play(Track& track, Faults& faults, const Pacer& pacer, const std::atomic<bool>& stop,
          const Prepare& prepare, const Send& send) {
  std::vector<Item> due;
  Item item;
  for (bool more = true; more;) {
    more = track.next(item);
    due.clear();
    more ? faults.push(item, due) : faults.finish(due);
    for (const Item& next : due) {
      prepare(next);
      if (!pacer.wait_until(next.elapsed_ns, stop)) {
        return;
      }
      send(next);
    }
  }
}

}  // namespace

CanPlayed play_can(CanTrack& track, CanFaults& faults, const SendFrame& send, const Pacer& pacer,
                   const std::atomic<bool>& stop) {
  CanPlayed played;
  const auto send_frame = [&](const TimedFrame& next) {
    ++played.frames;
    const SendVerdict verdict = send_patiently(send, next.frame, played.queue_waits);
    ++played.verdicts[static_cast<std::size_t>(verdict)];
    if (verdict == SendVerdict::kSent) {
      played.lateness.add(pacer.late_ns(next.elapsed_ns));
    }
  };
  play<TimedFrame>(
      track, faults, pacer, stop, [](const TimedFrame&) {}, send_frame);
  return played;
}

CameraPlayed play_camera(CameraTrack& track, CameraFaults& faults, const PublishImage& publish,
                         const Pacer& pacer, const std::atomic<bool>& stop) {
  CameraPlayed played;
  std::vector<std::byte> message;
  const auto prepare = [&](const TimedImage& next) {
    if (next.black) {
      message = black_image(next.message);
    } else {
      message.assign(next.message.begin(), next.message.end());
    }
  };
  const auto send_image = [&](const TimedImage& next) {
    transport::set_image_time(message, pacer.unix_ns(next.stamp_ns) / 1000);
    ++played.images;
    if (publish(message)) {
      played.lateness.add(pacer.late_ns(next.elapsed_ns));
    } else {
      ++played.failed;
    }
  };
  play<TimedImage>(track, faults, pacer, stop, prepare, send_image);
  return played;
}

}  // namespace topoloc::replay
