// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"
#include "topoloc/replay/fault_choice.hpp"
#include "topoloc/replay/fault_script.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace topoloc::replay {

/// A frame and when it is to be sent, in drive time since the start of the replay.
struct TimedFrame {
  std::int64_t elapsed_ns = 0;
  can::Frame frame;
};

/// What the faults of a script make of a stream of CAN frames. Where several faults are active at
/// once, they take effect in the script's order. The same script and frames give the same result.
class CanFaults {
 public:
  /// The script must outlive it.
  explicit CanFaults(const FaultScript& script);

  /// Takes the next frame, in order of time, and appends what is to be sent by then to `out`, in
  /// order of time.
  void push(const TimedFrame& frame, std::vector<TimedFrame>& out);
  /// At the end: what is still held back.
  void finish(std::vector<TimedFrame>& out);

  /// How many frames each fault of the script has changed, by its place there.
  [[nodiscard]] const std::vector<std::uint64_t>& affected() const { return affected_; }

 private:
  struct Overtaken {
    TimedFrame frame;
    int by;  ///< so many more frames go first
  };
  struct State {
    const Fault* fault;
    FaultChoice choice;
    /// kCanFrozen: the last payload before it, by interface and id.
    std::map<std::pair<std::string, can::FrameId>, std::array<std::uint8_t, can::kMaxPayloadBytes>>
        last;
    std::vector<TimedFrame> held;        ///< kCanBurst
    std::optional<Overtaken> overtaken;  ///< kCanReorder: one at a time
  };

  void run(std::size_t from, const TimedFrame& frame, std::vector<TimedFrame>& out);
  void release_held(std::int64_t elapsed_ns, std::vector<TimedFrame>& out);
  void let_go(std::size_t index, std::int64_t elapsed_ns, std::vector<TimedFrame>& out);
  void freeze(State& state, bool active, can::Frame& frame, std::uint64_t& affected);
  void seal(can::Frame& frame) const;

  const FaultScript* script_;
  std::vector<State> states_;
  std::int64_t last_ns_ = 0;
  std::vector<std::uint64_t> affected_;
};

}  // namespace topoloc::replay
