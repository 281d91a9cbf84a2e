// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/replay/fault_choice.hpp"
#include "topoloc/replay/fault_script.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace topoloc::replay {

/// An image and when it is to be sent, in drive time since the start of the replay.
struct TimedImage {
  std::int64_t elapsed_ns = 0;
  std::int64_t stamp_ns = 0;           ///< mid-exposure, on the same time line
  std::span<const std::byte> message;  ///< image_t as logged; its time is not used
  bool black = false;                  ///< to be sent with all pixels black
};

/// What the faults of a script make of a stream of images; as CanFaults otherwise.
class CameraFaults {
 public:
  /// The message of the image at, or next before, a time since the start; empty if there is none.
  using Elsewhere = std::function<std::span<const std::byte>(std::int64_t elapsed_ns)>;

  /// The script must outlive it.
  CameraFaults(const FaultScript& script, Elsewhere elsewhere);

  /// Takes the next image, in order of time, and appends what is to be sent by then to `out`, in
  /// order of time.
  void push(const TimedImage& image, std::vector<TimedImage>& out);
  /// At the end: what is still held back.
  void finish(std::vector<TimedImage>& out);

  [[nodiscard]] const std::vector<std::uint64_t>& affected() const { return affected_; }

 private:
  struct State {
    const Fault* fault;
    FaultChoice choice;
    std::span<const std::byte> last;  ///< kCameraFreeze: what came before it
  };

  void release(std::int64_t elapsed_ns, std::vector<TimedImage>& out);

  Elsewhere elsewhere_;
  std::vector<State> states_;
  std::vector<TimedImage> waiting_;  ///< sorted by time to be sent
  std::vector<std::uint64_t> affected_;
};

}  // namespace topoloc::replay
