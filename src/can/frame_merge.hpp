// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace topoloc::can {

/// Frames of one interface that wait to be handed out, oldest first. All memory is there from the
/// start.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t capacity) : frames_(capacity) {}

  /// Moves what waits to the front and gives the room behind it, to be filled and add()ed.
  /// From then on what was there before counts as waiting since an earlier call.
  std::span<Frame> make_room();
  void add(std::size_t count) { end_ += count; }

  [[nodiscard]] bool empty() const { return begin_ == end_; }
  [[nodiscard]] const Frame& front() const { return frames_[begin_]; }
  [[nodiscard]] bool front_is_new() const { return begin_ >= new_from_; }
  void pop() {
    ++begin_;
    ++handed_out_;
  }
  [[nodiscard]] std::uint64_t handed_out() const { return handed_out_; }

  /// There may be more where these came from, older than what other queues hold.
  bool cut_short = false;

 private:
  std::vector<Frame> frames_;
  std::size_t begin_ = 0;
  std::size_t new_from_ = 0;
  std::size_t end_ = 0;
  std::uint64_t handed_out_ = 0;
};

/// Takes frames from the queues in the order of their stamps until `out` is full; returns how many.
/// It stops before a frame that one still unread might precede: at a new frame later than
/// `horizon_ns` (the time when the first queue was about to be filled), and where a queue that was
/// cut short runs empty. Frames that have waited since an earlier call are not held to the horizon:
/// a clock that is set back must not keep them for ever.
std::size_t merge(std::span<FrameQueue> queues, std::int64_t horizon_ns, std::span<Frame> out);

}  // namespace topoloc::can
