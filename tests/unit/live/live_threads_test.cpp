// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/estimator_thread.hpp"
#include "topoloc/live/journal_replay.hpp"
#include "topoloc/live/lcm_publisher.hpp"
#include "topoloc/live/lcm_receiver.hpp"
#include "topoloc/live/match_worker.hpp"
#include "topoloc/live/recorder.hpp"

#include "live/stop_event.hpp"
#include "support/scripted_bus.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <topoloc/command_t.hpp>
#include <topoloc/estimate_t.hpp>
#include <topoloc/initial_pose_t.hpp>
#include <topoloc/pose_t.hpp>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;

/// What a listener on LCM has heard.
struct Heard {
  std::vector<estimate_t> estimates;
  std::vector<status_t> statuses;
  std::vector<pose_t> poses;
};

/// Appends the messages of a channel to one of its lists.
template <typename Message, std::vector<Message> Heard::*kList>
void listen(lcm::LCM& lcm, const std::string& channel, Heard& heard) {
  lcm.subscribeFunction(
      channel,
      +[](const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/, Heard* to) {
        Message& message = (to->*kList).emplace_back();
        EXPECT_GT(message.decode(buffer->data, 0, static_cast<int>(buffer->data_size)), 0);
      },
      &heard);
}

/// All threads of the vehicle process, with a made-up bus, LCM in memory and a matcher that finds
/// nothing: what remains is how they work together.
class LiveThreads : public ::testing::Test {
 protected:
  LiveThreads() {
    listen<estimate_t, &Heard::estimates>(out_, channels_.estimate, heard_);
    listen<status_t, &Heard::statuses>(out_, channels_.status, heard_);
    listen<pose_t, &Heard::poses>(out_, channels_.pose, heard_);
  }

  LcmPublisher::Config publisher_config() {
    return {.channels = channels_, .crs = "", .last_pose = &last_pose_};
  }

  /// So long, and until `done`, as far as that comes within 12 s.
  void run(std::chrono::milliseconds duration, const std::function<bool()>& done) {
    EXPECT_EQ(recorder_.open(), "");
    std::jthread publish([&] { publisher_.run(stop_); });
    std::jthread record([&] { recorder_.run(stop_); });
    std::jthread match(
        [&] { matcher_.run([&](const MatcherStatus& status) { matcher_status_.write(status); }); });
    std::jthread receive([&] { receiver_.run(stop_, [&](const ReceiverStatus&) { ++handled_; }); });
    estimator_.start();
    const auto begin = std::chrono::steady_clock::now();
    const auto goes_on = [&] {
      const auto since = std::chrono::steady_clock::now() - begin;
      return since < duration || (since < 12s && !done());
    };
    while (goes_on()) {
      // One at a time: ThreadSanitizer sees no more of how LCM hands over than that it wakes up.
      if (handled_ == sent_) {
        send_image(clock_.now_ns());
      }
      std::this_thread::sleep_for(20ms);
    }
    estimator_.stop();
    mailbox_.close();
    stop_.set();
  }

  void send_image(std::int64_t time_ns) {
    cv::Mat grey(32, 64, CV_8UC1, cv::Scalar(100));
    const image_t image = testing::jpeg_image(time_ns / 1000, grey);
    publish("CAMERA", image);
  }
  template <typename Message>
  void publish(const std::string& channel, const Message& message) {
    ++sent_;
    in_.publish(channel, &message);
  }

  DrivenCar car_{1500};
  HostClock clock_;
  config::LcmChannels channels_;
  lcm::LCM in_{"memq://"};
  lcm::LCM out_{"memq://"};
  Heard heard_;
  EstimatorPorts ports_;
  realtime::Mailbox<CameraFrame> mailbox_;
  can::VehicleSignals signals_{car_.vehicle.can};
  ScriptedBus bus_{car_, clock_};
  EstimatorLoop loop_{
      {.estimator = car_.vehicle.estimator, .journal = true}, clock_, signals_, bus_, ports_};
  WakeEvent wake_;
  EstimatorThread estimator_{
      {.rate_hz = 200.0,
       .thread = {.name = "estimator", .fifo_priority = 0, .cpus = {}, .stack_bytes = 1 << 18},
       .wake_fd = wake_.fd()},
      loop_};
  realtime::SpscRing<NumberedMatchSet> recorded_{16};
  Recorder recorder_{{.folder = car_.temporary / "flight", .max_bytes = 1 << 24, .origin = {}},
                     recorded_,
                     ports_.journal};
  std::atomic<int> matched_{0};
  realtime::TripleBuffer<MatcherStatus> matcher_status_;
  MatchWorker matcher_{
      {.image_size = {64, 32}},
      clock_,
      {.match =
           [this](std::int64_t time_ns, const cv::Mat& grey, const matching::PosePrediction&,
                  estimation::MapMatchSet& out, matching::Effort) {
             EXPECT_EQ(grey.size(), cv::Size(64, 32));
             ++matched_;
             out.frame_time_ns = time_ns;
             out.node_count = 0;
             out.match_count = 0;
             return matching::FrameReport{};
           },
       .prefetch = [](const RigidTransform&) {}},
      mailbox_,
      ports_,
      &recorded_};
  LastPoseKeeper last_pose_{car_.temporary / "last.tum"};
  StopEvent stop_;
  std::uint64_t sent_ = 0;  ///< to the receiver
  std::atomic<std::uint64_t> handled_{0};
  std::atomic<bool> asked_to_stop_{false};
  LcmReceiver receiver_{{.camera = car_.vehicle.camera, .channels = channels_},
                        clock_,
                        in_,
                        mailbox_,
                        ports_,
                        [this] { asked_to_stop_ = true; }};
  LcmPublisher publisher_{
      publisher_config(), clock_, out_, ports_.outputs, wake_.fd(), [this](ProcessStatus& status) {
        status.estimator = estimator_.status();
        (void)matcher_status_.update();
        status.matcher = matcher_status_.read();
        status.mailbox = mailbox_.counts();
      }};
};

std::map<std::string, std::int64_t> counters(const status_t& status) {
  std::map<std::string, std::int64_t> result;
  for (const counter_t& counter : status.counters) {
    result[counter.name] = counter.value;
  }
  return result;
}

std::int64_t sum(const std::map<std::string, std::int64_t>& counts, const std::string& prefix) {
  std::int64_t total = 0;
  for (const auto& [name, count] : counts) {
    total += name.starts_with(prefix) ? count : 0;
  }
  return total;
}

TEST_F(LiveThreads, PublishEveryTickAndRecordWhatMadeIt) {
  loop_.start_from({Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()});
  run(1200ms, [&] { return matched_ > 0; });
  while (out_.handleTimeout(0) > 0) {
  }

  ASSERT_GE(heard_.statuses.size(), 2U);
  const status_t& last = heard_.statuses.back();
  EXPECT_TRUE(last.stopping);
  auto counts = counters(last);
  EXPECT_EQ(counts["estimates.published"], std::int64_t(heard_.estimates.size()));
  EXPECT_EQ(counts["ticks.done"], counts["estimates.published"] + counts["estimates.lost"]);
  EXPECT_EQ(heard_.estimates.back().tick + 1, counts["ticks.done"] + counts["ticks.missed"]);
  EXPECT_EQ(last.mode, estimate_t::MODE_DEAD_RECKONING);
  EXPECT_FALSE(heard_.poses.empty());
  EXPECT_GT(matched_, 0);
  EXPECT_EQ(counts["frames.matched"], matched_);
  EXPECT_GT(counts["signals.imu_samples"], 0);
  EXPECT_EQ(counts["signals.imu_samples"], sum(counts, "imu."));
  EXPECT_EQ(counts["signals.speed_samples"], sum(counts, "speed."));

  std::size_t i = 0;
  const ReplaySummary summary = replay_journal(car_.temporary / "flight", car_.vehicle.estimator,
                                               std::nullopt, [&](const TickOutput& output) {
                                                 ASSERT_LT(i, heard_.estimates.size());
                                                 EXPECT_EQ(heard_.estimates[i].position[0],
                                                           output.estimate.state.p_world_imu.x());
                                                 ++i;
                                               });
  EXPECT_TRUE(summary.is_exact());
  EXPECT_EQ(i, heard_.estimates.size());
}

TEST_F(LiveThreads, TakePosesAndCommandsFromLcm) {
  initial_pose_t pose{};
  pose.position[0] = 40.0;
  pose.orientation[0] = 1.0;
  publish(channels_.initial_pose, pose);
  pose.orientation[0] = 0.5;  // no unit quaternion
  publish(channels_.initial_pose, pose);
  const command_t stop{.utime = 0, .command = command_t::STOP};
  publish(channels_.command, stop);
  run(600ms, [&] { return asked_to_stop_.load(); });
  EXPECT_TRUE(asked_to_stop_);
  EXPECT_EQ(publisher_.status().newest.estimate.counters.starts, 1U);
  EXPECT_GT(publisher_.status().newest.estimate.state.p_world_imu.x(), 39.0);
}

TEST_F(LiveThreads, ReceiverEndsWithoutAMessageToWakeIt) {
  std::jthread receive([&] { receiver_.run(stop_, [](const ReceiverStatus&) {}); });
  std::this_thread::sleep_for(50ms);
  const auto begin = std::chrono::steady_clock::now();
  stop_.set();
  receive.join();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);  // it looks once a second by itself
}

}  // namespace
}  // namespace topoloc::live
