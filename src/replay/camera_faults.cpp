// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/camera_faults.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace topoloc::replay {

CameraFaults::CameraFaults(const FaultScript& script, Elsewhere elsewhere)
    : elsewhere_(std::move(elsewhere)), affected_(script.faults.size()) {
  for (std::size_t i = 0; i < script.faults.size(); ++i) {
    states_.push_back({.fault = &script.faults[i], .choice = {script.seed, i}, .last = {}});
  }
}

void CameraFaults::push(const TimedImage& image, std::vector<TimedImage>& out) {
  release(image.elapsed_ns, out);
  TimedImage current = image;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    const Fault& fault = *state.fault;
    // Of delayed images, too, the faults go by the time at which they would have come.
    const bool active = concerns_camera(fault.kind) && fault.active(image.elapsed_ns);
    if (!active || state.last.empty()) {
      state.last = current.message;  // a freeze from the first image on keeps that one
    }
    if (!active || !state.choice.takes(fault.share)) {
      continue;
    }
    ++affected_[i];
    switch (fault.kind) {
      case FaultKind::kCameraDrop:
        return;
      case FaultKind::kCameraFreeze:
        current.message = state.last;
        break;
      case FaultKind::kCameraBlackout:
        current.black = true;
        break;
      case FaultKind::kCameraTimeStep:
        current.stamp_ns += fault.offset_ns;
        break;
      case FaultKind::kCameraDelay:
        current.elapsed_ns += fault.offset_ns;
        break;
      case FaultKind::kCameraElsewhere:
        if (const auto message = elsewhere_(image.elapsed_ns + fault.offset_ns); !message.empty()) {
          current.message = message;
        }
        break;
      default:
        break;
    }
  }
  const auto later = [](const TimedImage& a, const TimedImage& b) {
    return a.elapsed_ns < b.elapsed_ns;
  };
  waiting_.insert(std::upper_bound(waiting_.begin(), waiting_.end(), current, later), current);
  release(image.elapsed_ns, out);
}

void CameraFaults::release(std::int64_t elapsed_ns, std::vector<TimedImage>& out) {
  const auto end = std::find_if(waiting_.begin(), waiting_.end(), [&](const TimedImage& image) {
    return image.elapsed_ns > elapsed_ns;
  });
  out.insert(out.end(), waiting_.begin(), end);
  waiting_.erase(waiting_.begin(), end);
}

void CameraFaults::finish(std::vector<TimedImage>& out) {
  release(std::numeric_limits<std::int64_t>::max(), out);
}

}  // namespace topoloc::replay
