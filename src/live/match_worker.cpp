// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/match_worker.hpp"

#include "topoloc/drive/image_decoding.hpp"
#include "topoloc/transport/image_view.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <thread>
#include <utility>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;

template <typename Counts, typename Enum>
void count(Counts& counts, Enum what) {
  ++counts[static_cast<std::size_t>(what)];
}

std::int64_t to_ns(double milliseconds) {
  return static_cast<std::int64_t>(std::llround(milliseconds * 1e6));
}

}  // namespace

const char* name(FrameFate fate) {
  switch (fate) {
    case FrameFate::kMatched:
      return "matched";
    case FrameFate::kUndecodable:
      return "undecodable";
    case FrameFate::kNotStarted:
      return "not_started";
    case FrameFate::kNoPrediction:
      return "no_prediction";
    case FrameFate::kNotMatched:
      return "not_matched";
    case FrameFate::kEstimatorBusy:
      return "estimator_busy";
    case FrameFate::kFailed:
      return "failed";
  }
  return "unknown";
}

MatchWorker::MatchWorker(const Config& config, const HostClock& clock, FrameMatcher matcher,
                         realtime::Mailbox<CameraFrame>& frames, EstimatorPorts& ports,
                         realtime::SpscRing<NumberedMatchSet>* recorder)
    : config_(config),
      matcher_(std::move(matcher)),
      frames_(frames),
      ports_(ports),
      recorder_(recorder),
      clock_(clock),
      governor_(config.budget_ns, static_cast<int>(matcher_.least_effort) + 1) {}

void MatchWorker::run(const std::function<void(const MatcherStatus&)>& report) {
  CameraFrame frame;
  while (true) {
    const realtime::MailboxTake taken = frames_.take(frame, 1s);
    if (taken == realtime::MailboxTake::kClosed) {
      return;
    }
    if (taken == realtime::MailboxTake::kTimeout) {
      continue;
    }
    FrameFate fate = FrameFate::kFailed;
    try {
      fate = take(frame);
    } catch (const std::exception&) {  // the next frame may do
    }
    count(status_.frames, fate);
    report(status_);
  }
}

FrameFate MatchWorker::take(const CameraFrame& frame) {
  FramePrediction prediction;
  if (!ask(frame.time_ns, prediction)) {
    return FrameFate::kNoPrediction;
  }
  if (!prediction.known) {
    return FrameFate::kNotStarted;
  }
  transport::ImageView image;
  transport::view_image(frame.message, image);
  if (!drive::decode_grey(image, config_.image_size, grey_)) {
    return FrameFate::kUndecodable;
  }
  const auto effort = static_cast<matching::Effort>(governor_.level());
  const matching::FrameReport report =
      matcher_.match(frame.time_ns, grey_, prediction.pose, matches_.set, effort);
  count(status_.verdicts, report.verdict);
  status_.damaged_nodes += static_cast<std::uint64_t>(report.damaged_nodes);
  status_.over_capacity += static_cast<std::uint64_t>(report.over_capacity);
  status_.extract.record(to_ns(report.times.undistort_ms + report.times.extract_ms));
  status_.match.record(
      to_ns(report.times.select_ms + report.times.match_ms + report.times.outliers_ms));
  const bool matched = report.verdict == matching::FrameVerdict::kOk;
  const bool handed_over = matched && hand_over();
  note_latency(clock_.now_ns() - frame.received_ns);
  prefetch(prediction);
  return handed_over ? FrameFate::kMatched
         : matched   ? FrameFate::kEstimatorBusy
                     : FrameFate::kNotMatched;
}

bool MatchWorker::ask(std::int64_t time_ns, FramePrediction& prediction) {
  // The estimator answers within a tick; a few pass before it is given up.
  constexpr auto kPatience = 50ms;
  constexpr auto kPause = 500us;
  if (!ports_.asked.try_push(time_ns)) {
    return false;
  }
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < until) {
    // Answers that came too late for the frames before are thrown away.
    while (ports_.predictions.try_pop(prediction)) {
      if (prediction.time_ns == time_ns) {
        return true;
      }
    }
    std::this_thread::sleep_for(kPause);
  }
  return false;
}

bool MatchWorker::hand_over() {
  NumberedMatchSet* const slot = ports_.match_sets.write_slot();
  if (slot == nullptr) {
    return false;
  }
  slot->number = matches_.number = next_number_++;
  slot->set.assign(matches_.set);
  // Recorded before the estimator can have it: a tick never names a set that is not there.
  if (recorder_ != nullptr) {
    NumberedMatchSet* const copy = recorder_->write_slot();
    if (copy != nullptr) {
      copy->number = matches_.number;
      copy->set.assign(matches_.set);
      recorder_->commit_write();
    } else {
      ++status_.unrecorded;
    }
  }
  ports_.match_sets.commit_write();
  return true;
}

void MatchWorker::note_latency(std::int64_t latency_ns) {
  status_.total.record(latency_ns);
  governor_.note(latency_ns);
  status_.over_budget = governor_.missed();
  status_.slowdowns = governor_.slowdowns();
  status_.effort = governor_.level();
}

void MatchWorker::prefetch(const FramePrediction& prediction) const {
  constexpr double kAhead_s = 1.5;
  RigidTransform ahead = prediction.pose.T_world_imu;
  ahead.p += kAhead_s * prediction.v_world_mps;
  matcher_.prefetch(ahead);
}

}  // namespace topoloc::live
