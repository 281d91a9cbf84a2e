// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/estimator_thread.hpp"
#include "topoloc/live/lcm_receiver.hpp"
#include "topoloc/live/match_worker.hpp"

#include <topoloc/status_t.hpp>
#include <topoloc/timing_t.hpp>

namespace topoloc::live {

/// What the publisher itself has done.
struct PublisherStatus {
  std::uint64_t published = 0;         ///< estimates
  std::uint64_t publish_failed = 0;    ///< messages that LCM did not take
  std::uint64_t journal_failed = 0;    ///< 1: nothing is recorded: no folder, disk full or gone
  std::uint64_t last_pose_failed = 0;  ///< times that the last pose could not be written
  realtime::LatencyHistogram latency;  ///< from the start of a tick to its message's being sent
};

/// Everything that the process knows of its own state.
struct ProcessStatus {
  TickOutput newest;
  EstimatorThreadStatus estimator;
  MatcherStatus matcher;
  realtime::MailboxCounts mailbox;
  ReceiverStatus receiver;
  PublisherStatus publisher;
  std::uint64_t can_before_start = 0;  ///< CAN frames thrown away when the process started
};

/// Counters and words. `message.utime`, `uptime_s` and `stopping` are the caller's.
void fill_status(const ProcessStatus& status, status_t& message);
/// The stages by name. `message.utime` is the caller's.
void fill_timing(const ProcessStatus& status, timing_t& message);

}  // namespace topoloc::live
