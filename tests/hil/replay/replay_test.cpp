// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
//
// The program on vcan0 and vcan1: tools/with-vcan runs it.
#include "topoloc/can/can_receiver.hpp"
#include "topoloc/can/candump.hpp"
#include "topoloc/transport/image_view.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <nlohmann/json.hpp>

namespace topoloc::replay {
namespace {

using std::chrono::steady_clock;

constexpr auto kUrl = "udpm://239.255.76.67:7699?ttl=0&recv_buf_size=4000000";
constexpr auto kPatience = std::chrono::seconds(60);
constexpr std::int64_t kStart_us = 1'600'000'000'000'000;
constexpr int kRows = 200;   // every 10 ms, four frames each
constexpr int kImages = 20;  // every 100 ms
constexpr int kWidth_px = 320;
constexpr int kHeight_px = 240;

/// Collects the stamps of what comes by LCM while it lives.
class ImageListener {
 public:
  ImageListener() : lcm_(kUrl) {
    lcm_.subscribe("CAMERA", &ImageListener::take, this);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        lcm_.handleTimeout(20);
      }
    });
  }
  std::vector<std::int64_t> finish() {
    thread_.request_stop();
    thread_.join();
    return stamps_ns_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  void take(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/) {
    transport::ImageView view;
    const auto* data = static_cast<const std::byte*>(buffer->data);
    ASSERT_EQ(transport::view_image({data, buffer->data_size}, view), transport::ImageVerdict::kOk);
    stamps_ns_.push_back(view.time_us * 1000);
    count_ = stamps_ns_.size();
  }
  lcm::LCM lcm_;
  std::vector<std::int64_t> stamps_ns_;
  std::atomic<std::size_t> count_ = 0;
  std::jthread thread_;
};

class ReplayTest : public ::testing::Test {
 protected:
  ReplayTest()
      : drive_(folder_ / "drive", {.width_px = kWidth_px,
                                   .height_px = kHeight_px,
                                   .fx_px = 200,
                                   .fy_px = 200,
                                   .cx_px = 160,
                                   .cy_px = 120}) {
    std::vector<testing::CanRow> rows;
    for (int i = 0; i < kRows; ++i) {
      rows.push_back({.time_us = kStart_us + i * 10'000, .speed_mps = 0.02 * i});
    }
    drive_.write_can_log(rows);
    std::vector<image_t> images;
    for (int i = 0; i < kImages; ++i) {
      cv::Mat noise(kHeight_px, kWidth_px, CV_8UC1);
      cv::randu(noise, 0, 256);  // does not compress: several datagrams an image
      images.push_back(testing::jpeg_image(kStart_us + i * 100'000, noise));
    }
    drive_.write_images(images);
  }

  /// Runs topoloc-replay to its end while `meanwhile` is called every 2 ms; its summary.
  nlohmann::json replay(const std::string& options, const std::function<void()>& meanwhile) {
    const auto summary = folder_ / "summary.json";
    std::atomic<int> status = -1;
    std::jthread program([&] {
      const std::string command = "echo $$ > " + (folder_ / "pid").string() + "; exec " +
                                  std::string(TOPOLOC_BIN_DIR) + "/topoloc-replay --drive " +
                                  drive_.dir().string() + " " + options + " --json " +
                                  summary.string() + " >/dev/null";
      status = std::system(command.c_str());
    });
    for (const auto end = steady_clock::now() + kPatience;
         status == -1 && steady_clock::now() < end;) {
      meanwhile();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    program.join();
    meanwhile();
    EXPECT_EQ(status, 0);
    return nlohmann::json::parse(testing::bytes_of(summary));
  }

  testing::TemporaryFolder folder_;
  testing::DriveFolder drive_;
};

TEST_F(ReplayTest, PlaysEveryFrameAndImageOnOneTimeLine) {
  can::CanReceiver receiver({{.device = "vcan0"}});
  ImageListener listener;
  std::vector<can::Frame> frames;
  const auto summary = replay("--can vcan0 --lcm '" + std::string(kUrl) + "'", [&] {
    const auto received = receiver.receive();
    frames.insert(frames.end(), received.begin(), received.end());
  });
  for (int i = 0; i < 500 && listener.count() < kImages; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto stamps_ns = listener.finish();

  ASSERT_EQ(frames.size(), 4U * kRows);
  EXPECT_EQ(receiver.counters().dropped, 0U);
  EXPECT_EQ(summary["can"]["sent"], 4 * kRows);
  EXPECT_EQ(summary["camera"]["sent"], kImages);
  can::CandumpReader log(drive_ / "can.log");
  can::Frame logged;
  for (const can::Frame& frame : frames) {
    ASSERT_TRUE(log.next(logged));
    EXPECT_EQ(frame.id, logged.id);
    EXPECT_EQ(frame.data, logged.data);
  }
  // Image k was exposed with row 10 k: a frame is sent when it is due, never before, and on the
  // median of all not much after that.
  ASSERT_EQ(stamps_ns.size(), static_cast<std::size_t>(kImages));
  std::vector<std::int64_t> late_ns;
  for (std::size_t k = 0; k < stamps_ns.size(); ++k) {
    late_ns.push_back(frames[40 * k].time_ns - stamps_ns[k]);
    EXPECT_GE(late_ns.back(), -1'000'000) << "stamps are whole microseconds, clocks read apart";
    EXPECT_NEAR(static_cast<double>(stamps_ns[k] - stamps_ns[0]), 1e8 * static_cast<double>(k),
                1e6);
  }
  std::nth_element(late_ns.begin(), late_ns.begin() + kImages / 2, late_ns.end());
  EXPECT_LT(late_ns[kImages / 2], 20'000'000);
}

TEST_F(ReplayTest, FaultsReachTheBus) {
  const auto script = folder_.with("faults.yaml", R"(format: 1
faults:
- {kind: can_dropout, at_s: 0.5, for_s: 0.5, messages: [IMU_RATE]}
- {kind: can_duplicate, at_s: 1.0, for_s: 0.1, messages: [WHEEL_SPEEDS]}
- {kind: camera_drop, at_s: 0.95, for_s: 0.5}
)");
  can::CanReceiver receiver({{.device = "vcan1"}});
  ImageListener listener;
  std::map<std::uint32_t, int> counts;
  const auto summary =
      replay("--can can0=vcan1 --lcm '" + std::string(kUrl) + "' --faults " + script.string(), [&] {
        for (const can::Frame& frame : receiver.receive()) {
          ++counts[frame.id];
        }
      });
  EXPECT_EQ(counts[0x100], kRows);
  EXPECT_EQ(counts[0x101], kRows - 50);
  EXPECT_EQ(counts[0x102], kRows + 10);
  EXPECT_EQ(counts[0x103], kRows);
  EXPECT_EQ(summary["camera"]["sent"], kImages - 5);
  EXPECT_EQ(summary["faults"][0]["affected"], 50);
  EXPECT_EQ(summary["faults"][2]["affected"], 5);
}

TEST_F(ReplayTest, LoopsUntilItIsStopped) {
  can::CanReceiver receiver({{.device = "vcan0"}});
  std::vector<std::int64_t> times_ns;
  bool stopped = false;
  const auto summary = replay("--can vcan0 --loop --duration 0.5 --speed 5", [&] {
    for (const can::Frame& frame : receiver.receive()) {
      if (frame.id == 0x100) {
        times_ns.push_back(frame.time_ns);
      }
    }
    if (times_ns.size() > 160 && !stopped) {  // three laps of 50 rows and more
      stopped = ::kill(std::stoi(testing::bytes_of(folder_ / "pid")), SIGINT) == 0;
    }
  });
  EXPECT_TRUE(stopped);
  EXPECT_TRUE(std::is_sorted(times_ns.begin(), times_ns.end()));
  EXPECT_GE(summary["can"]["sent"].get<int>(), 640);
}

TEST_F(ReplayTest, OutlivesAnInterfaceThatIsDownForAWhile) {
  can::CanReceiver receiver({{.device = "vcan0"}});
  std::size_t received = 0;
  int step = 0;
  const auto summary = replay("--can vcan0", [&] {
    received += receiver.receive().size();
    const auto ip = [](const std::string& state) {
      return std::system(("PATH=$PATH:/usr/sbin:/sbin ip link set vcan0 " + state).c_str()) == 0;
    };
    if (step == 0 && received > 100) {
      step = ip("down") ? 1 : -1;
    } else if (step == 1 && receiver.state(0) == can::CanState::kDown) {
      step = ip("up") ? 2 : -1;
    }
  });
  EXPECT_EQ(step, 2);
  const auto sent = summary["can"]["sent"].get<std::size_t>();
  EXPECT_EQ(sent + summary["can"]["not_sent"].value("interface down", std::size_t{0}), 4U * kRows);
  EXPECT_GT(received, 100U);
  EXPECT_LE(received, sent);
}

}  // namespace
}  // namespace topoloc::replay
