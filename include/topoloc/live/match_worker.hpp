// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/camera_frame.hpp"
#include "topoloc/live/estimator_loop.hpp"
#include "topoloc/live/latency_governor.hpp"
#include "topoloc/matching/map_matcher.hpp"
#include "topoloc/realtime/latency_histogram.hpp"
#include "topoloc/realtime/mailbox.hpp"
#include "topoloc/realtime/spsc_ring.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>

#include <opencv2/core.hpp>

namespace topoloc::live {

/// What became of a frame that reached the matcher.
enum class FrameFate : std::uint8_t {
  kMatched,        ///< its match set went to the estimator
  kUndecodable,    ///< JPEG data that is none
  kNotStarted,     ///< the filter does not run, or the frame is older than its history
  kNoPrediction,   ///< the estimator did not answer
  kNotMatched,     ///< matching::FrameVerdict says why
  kEstimatorBusy,  ///< the estimator has not taken the sets before
  kFailed,         ///< matching threw: out of memory, or a library's complaint
};
inline constexpr std::size_t kFrameFates = 7;
const char* name(FrameFate fate);

/// How the matcher is doing, since the start.
struct MatcherStatus {
  std::array<std::uint64_t, kFrameFates> frames{};                 ///< by FrameFate
  std::array<std::uint64_t, matching::kFrameVerdicts> verdicts{};  ///< by matching::FrameVerdict
  std::uint64_t damaged_nodes = 0;
  std::uint64_t over_capacity = 0;     ///< matches beyond estimation::kMaxMatches
  std::uint64_t over_budget = 0;       ///< frames that took longer than the latency budget
  std::uint64_t slowdowns = 0;         ///< times that less effort was chosen
  std::uint64_t unrecorded = 0;        ///< match sets that the recorder was too slow for
  int effort = 0;                      ///< of the next frame: matching::Effort
  realtime::LatencyHistogram extract;  ///< undistortion and features
  realtime::LatencyHistogram match;    ///< nodes, matches, outliers
  realtime::LatencyHistogram total;    ///< from reception to the end
};

/// The matcher as the worker sees it: matching::MapMatcher, or a test's.
struct FrameMatcher {
  std::function<matching::FrameReport(std::int64_t time_ns, const cv::Mat& grey,
                                      const matching::PosePrediction& prediction,
                                      estimation::MapMatchSet& out, matching::Effort effort)>
      match;
  std::function<void(const RigidTransform& T_world_imu)> prefetch;
  matching::Effort least_effort = matching::Effort::kFull;
};

/// The matching thread: takes the newest frame, asks the estimator where it was taken, matches it
/// with the map and hands the matches over, with no more effort than the latency budget allows.
class MatchWorker {
 public:
  struct Config {
    cv::Size image_size;
    std::int64_t budget_ns = 100'000'000;
  };

  /// All references outlive this. `recorder`: gets a copy of each match set; may be null.
  MatchWorker(const Config& config, const HostClock& clock, FrameMatcher matcher,
              realtime::Mailbox<CameraFrame>& frames, EstimatorPorts& ports,
              realtime::SpscRing<NumberedMatchSet>* recorder);

  /// Until the mailbox is closed. `report` is called after each frame, in the worker's thread.
  void run(const std::function<void(const MatcherStatus&)>& report);

 private:
  FrameFate take(const CameraFrame& frame);
  bool ask(std::int64_t time_ns, FramePrediction& prediction);
  bool hand_over();
  void note_latency(std::int64_t latency_ns);
  void prefetch(const FramePrediction& prediction) const;

  Config config_;
  FrameMatcher matcher_;
  realtime::Mailbox<CameraFrame>& frames_;
  EstimatorPorts& ports_;
  realtime::SpscRing<NumberedMatchSet>* recorder_;
  HostClock clock_;
  LatencyGovernor governor_;
  cv::Mat grey_;
  NumberedMatchSet matches_;
  std::uint64_t next_number_ = 0;
  MatcherStatus status_;
};

}  // namespace topoloc::live
