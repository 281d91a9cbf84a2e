// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/batch.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <stdexcept>

#include <fmt/core.h>

namespace topoloc::localiser {
namespace {

/// A match set on its way from the matcher to the estimator.
struct Delivery {
  std::int64_t ready_ns = 0;
  std::unique_ptr<estimation::MapMatchSet> set;
};

/// Hands out the part of a time-sorted sequence up to a time, each element once.
template <typename Sample>
class Feed {
 public:
  explicit Feed(const std::vector<Sample>& samples) : samples_(samples) {}
  std::span<const Sample> until(std::int64_t time_ns) {
    const std::size_t begin = next_;
    while (next_ < samples_.size() && samples_[next_].time_ns <= time_ns) {
      ++next_;
    }
    return std::span(samples_).subspan(begin, next_ - begin);
  }

 private:
  const std::vector<Sample>& samples_;
  std::size_t next_ = 0;
};

using ImuIterator = std::vector<estimation::ImuSample>::const_iterator;

ImuIterator first_sample_from(const drive::Drive& drive, std::int64_t time_ns) {
  return std::lower_bound(
      drive.imu.begin(), drive.imu.end(), time_ns,
      [](const estimation::ImuSample& sample, std::int64_t time) { return sample.time_ns < time; });
}

/// The first inertial sample from the wanted start on.
std::int64_t start_time(const drive::Drive& drive, const BatchOptions& options) {
  const std::int64_t wanted_ns =
      drive.imu.front().time_ns + static_cast<std::int64_t>(std::llround(options.start_s * 1e9));
  const auto first = first_sample_from(drive, wanted_ns);
  if (first == drive.imu.end()) {
    throw std::runtime_error(drive.dir.string() + ": the drive ends before the start at " +
                             std::to_string(options.start_s) + " s");
  }
  return first->time_ns;
}

void check_pauses(const drive::Drive& drive, std::int64_t start_ns) {
  const auto pause = std::adjacent_find(
      first_sample_from(drive, start_ns), drive.imu.end(),
      [](const estimation::ImuSample& sample, const estimation::ImuSample& next) {
        return 1e-9 * static_cast<double>(next.time_ns - sample.time_ns) > kMaxPause_s;
      });
  if (pause == drive.imu.end()) {
    return;
  }
  throw std::runtime_error(
      fmt::format("{}: no IMU sample from {:.6f} to {:.6f} s: a wrong time stamp, or a pause of "
                  "more than {:.0f} "
                  "s (--start-seconds can begin after it)",
                  (drive.dir / "can.log").string(), 1e-9 * static_cast<double>(pause->time_ns),
                  1e-9 * static_cast<double>(std::next(pause)->time_ns), kMaxPause_s));
}

estimation::InitialPose initial_pose(const drive::Drive& drive, const BatchOptions& options,
                                     std::int64_t start_ns) {
  if (options.initial_pose) {
    return {.time_ns = start_ns, .T_world_imu = *options.initial_pose};
  }
  if (!drive.ground_truth) {
    throw std::runtime_error(drive.dir.string() +
                             ": no initial pose: give --initial-pose, or a drive with "
                             "ground_truth.tum");
  }
  // Logged stamps are whole microseconds: the truth of a sample may come a fraction later.
  constexpr std::int64_t kRounding_ns = 1'000;
  const evaluation::Trajectory& truth = *drive.ground_truth;
  const std::int64_t truth_ns = truth.front().time_ns;
  constexpr std::int64_t kMaxGap_ns = 1'000'000'000;
  const auto sample = first_sample_from(drive, std::max(start_ns, truth_ns - kRounding_ns));
  if (sample != drive.imu.end() && sample->time_ns - start_ns <= kMaxGap_ns) {
    const std::int64_t time_ns = std::max(sample->time_ns, truth_ns);
    if (const auto pose = evaluation::pose_at(truth, time_ns, kMaxGap_ns)) {
      return {.time_ns = sample->time_ns, .T_world_imu = *pose};
    }
  }
  throw std::runtime_error(drive.dir.string() +
                           ": ground_truth.tum has no pose at the start; give --initial-pose");
}

/// Frames, matcher and the results on their way.
class FramePipeline {
 public:
  FramePipeline(const drive::Drive& drive, drive::FrameLog& log, const map::MapFile& map,
                const BatchOptions& options)
      : log_(log),
        options_(options),
        matcher_(drive.vehicle.matching, map, drive.vehicle.camera.kalibr.calibration,
                 drive.vehicle.camera.kalibr.T_imu_cam, drive::read_mask(drive.vehicle.camera)) {
    if (options.effort > matcher_.least_effort()) {
      throw std::runtime_error(
          "effort 2 needs a model for half of the image's rows (docs/models.md), which is not "
          "there");
    }
  }

  /// Matches the frames up to now with the prediction for their time.
  void take_frames(std::int64_t now_ns, const estimation::Estimator& estimator,
                   BatchResult& result) {
    for (; next_ < log_.size() && log_.time_ns(next_) <= now_ns; ++next_) {
      if (!drive::selected(options_.frames, next_)) {
        continue;
      }
      if (log_.time_ns(next_) < free_again_ns_) {
        ++result.frames_skipped;
        continue;
      }
      match(next_, estimator, result);
    }
  }

  /// Match sets that have reached the estimator by now. Valid until the next call.
  std::span<const estimation::MapMatchSet* const> delivered(std::int64_t now_ns) {
    arrived_.clear();
    spare_.insert(spare_.end(), std::make_move_iterator(in_use_.begin()),
                  std::make_move_iterator(in_use_.end()));
    in_use_.clear();
    while (!on_the_way_.empty() && on_the_way_.front().ready_ns <= now_ns) {
      arrived_.push_back(on_the_way_.front().set.get());
      in_use_.push_back(std::move(on_the_way_.front().set));
      on_the_way_.pop_front();
    }
    return arrived_;
  }

 private:
  void match(std::size_t index, const estimation::Estimator& estimator, BatchResult& result) {
    const std::int64_t time_ns = log_.time_ns(index);
    estimation::Covariance P;
    const auto state = estimator.state_at(time_ns, P);
    if (!state) {
      ++result.frames_before_start;
      return;
    }
    const cv::Mat image = log_.grey(index);
    if (image.empty()) {
      return;  // counted by the log
    }
    free_again_ns_ = time_ns + std::llround(options_.match_seconds * 1e9);
    std::unique_ptr<estimation::MapMatchSet> set;
    if (spare_.empty()) {
      set = std::make_unique<estimation::MapMatchSet>();
    } else {
      set = std::move(spare_.back());
      spare_.pop_back();
    }
    FrameRecord record{.frame_index = index, .time_ns = time_ns, .matching = {}, .update = {}};
    record.matching =
        matcher_.match(time_ns, image,
                       {.T_world_imu = state->T_world_imu(), .covariance = P.topLeftCorner<6, 6>()},
                       *set, options_.effort);
    result.frames.push_back(record);
    if (record.matching.verdict != matching::FrameVerdict::kOk) {
      spare_.push_back(std::move(set));
      return;
    }
    const std::int64_t delay_ns =
        std::llround((options_.match_delay_s + options_.match_seconds) * 1e9);
    on_the_way_.push_back({.ready_ns = time_ns + delay_ns, .set = std::move(set)});
  }

  drive::FrameLog& log_;
  BatchOptions options_;
  matching::MapMatcher matcher_;
  std::size_t next_ = 0;
  std::int64_t free_again_ns_ = std::numeric_limits<std::int64_t>::min();
  std::deque<Delivery> on_the_way_;
  std::vector<const estimation::MapMatchSet*> arrived_;
  std::vector<std::unique_ptr<estimation::MapMatchSet>> in_use_;
  std::vector<std::unique_ptr<estimation::MapMatchSet>> spare_;
};

void note_updates(std::span<const estimation::MapUpdateReport> reports, BatchResult& result) {
  for (const auto& report : reports) {
    const auto record = std::find_if(
        result.frames.rbegin(), result.frames.rend(),
        [&](const FrameRecord& frame) { return frame.time_ns == report.frame_time_ns; });
    if (record != result.frames.rend()) {
      record->update = report;
    }
  }
}

}  // namespace

BatchResult run_batch(const drive::Drive& drive, drive::FrameLog* frames, const map::MapFile* map,
                      const BatchOptions& options, const BatchObserver& observer) {
  estimation::EstimatorConfig config =
      map != nullptr ? drive.vehicle.estimator : estimation::without_map(drive.vehicle.estimator);
  config.use_speed = config.use_speed && options.use_speed;
  if (config.use_speed && drive.speed.empty()) {
    throw std::runtime_error(
        drive.dir.string() +
        ": the drive has no wheel speed; if that is meant, run with --no-speed, or with 'speed: "
        "{use: false}' in vehicle.yaml");
  }
  estimation::Estimator estimator(config);
  std::unique_ptr<FramePipeline> pipeline;
  if (frames != nullptr && map != nullptr) {
    pipeline = std::make_unique<FramePipeline>(drive, *frames, *map, options);
  }

  BatchResult result;
  Feed imu(drive.imu);
  Feed speed(drive.speed);
  const std::int64_t start_ns = start_time(drive, options);
  check_pauses(drive, start_ns);
  imu.until(start_ns - 1);  // left out, as if the log began at the start
  speed.until(start_ns - 1);
  const std::int64_t end_ns = drive.imu.back().time_ns;
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / options.rate_hz));
  std::optional<estimation::InitialPose> start_pose = initial_pose(drive, options, start_ns);
  for (std::int64_t now_ns = start_ns; now_ns < end_ns + period_ns; now_ns += period_ns) {
    estimation::TickInputs inputs{
        .imu = imu.until(now_ns), .speed = speed.until(now_ns), .matches = {}, .initial_pose = {}};
    if (pipeline) {
      pipeline->take_frames(now_ns, estimator, result);
      inputs.matches = pipeline->delivered(now_ns);
    }
    inputs.initial_pose = start_pose;
    start_pose.reset();
    const estimation::Estimate& estimate = estimator.tick(now_ns, inputs);
    if (estimate.mode != estimation::Mode::kUninitialised) {
      ++result.estimates;
      if (observer.estimate) {
        observer.estimate(estimate);
      }
    }
    result.counters = estimate.counters;
    note_updates(estimator.map_reports(), result);
    if (observer.progress) {
      observer.progress(static_cast<double>(now_ns - start_ns) /
                        static_cast<double>(std::max<std::int64_t>(1, end_ns - start_ns)));
    }
  }
  return result;
}

}  // namespace topoloc::localiser
