// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/frame_merge.hpp"

#include <algorithm>

namespace topoloc::can {

std::span<Frame> FrameQueue::make_room() {
  if (begin_ > 0) {
    std::move(frames_.begin() + static_cast<std::ptrdiff_t>(begin_),
              frames_.begin() + static_cast<std::ptrdiff_t>(end_), frames_.begin());
  }
  end_ -= begin_;
  begin_ = 0;
  new_from_ = end_;
  return std::span(frames_).subspan(end_);
}

std::size_t merge(std::span<FrameQueue> queues, std::int64_t horizon_ns, std::span<Frame> out) {
  std::size_t count = 0;
  while (count < out.size()) {
    FrameQueue* oldest = nullptr;
    for (FrameQueue& queue : queues) {
      if (queue.empty()) {
        if (queue.cut_short) {
          return count;
        }
        continue;
      }
      if (oldest == nullptr || queue.front().time_ns < oldest->front().time_ns) {
        oldest = &queue;
      }
    }
    const bool one_source = queues.size() == 1;
    if (oldest == nullptr ||
        (!one_source && oldest->front_is_new() && oldest->front().time_ns > horizon_ns)) {
      break;
    }
    out[count++] = oldest->front();
    oldest->pop();
  }
  return count;
}

}  // namespace topoloc::can
