// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/player.hpp"

#include "topoloc/transport/image_view.hpp"

#include "replay/black_image.hpp"
#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::replay {
namespace {

using can::SendVerdict;

class PlayerTest : public ::testing::Test {
 protected:
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

  /// As many frames, all of the same time.
  CanTrack track(int count) {
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += "(1700000000.000000) can0 100#" + std::to_string(10 + i) + "\n";
    }
    return {folder_.with("can.log", text), {.begin_ns = kStart_ns, .end_ns = kStart_ns + 1}};
  }

  testing::TemporaryFolder folder_;
  FaultScript none_;
  CanFaults faults_{none_};
  std::atomic<bool> stop_ = false;
};

TEST_F(PlayerTest, TellsWhatBecameOfEveryFrame) {
  CanTrack four = track(4);
  int calls = 0;
  const auto send = [&](const can::Frame& frame) {
    ++calls;
    switch (frame.data[0]) {
      case 0x10:
        return SendVerdict::kDown;
      case 0x11:
        return calls < 4 ? SendVerdict::kQueueFull : SendVerdict::kSent;  // waits for room
      default:
        return SendVerdict::kSent;
    }
  };
  const CanPlayed played = play_can(four, faults_, send, Pacer(100.0), stop_);
  EXPECT_EQ(played.frames, 4U);
  EXPECT_EQ(played.verdicts[static_cast<std::size_t>(SendVerdict::kSent)], 3U);
  EXPECT_EQ(played.verdicts[static_cast<std::size_t>(SendVerdict::kDown)], 1U);
  EXPECT_EQ(played.verdicts[static_cast<std::size_t>(SendVerdict::kQueueFull)], 0U);
  EXPECT_EQ(played.queue_waits, 1U);
  EXPECT_EQ(played.lateness.count(), 3U);
}

TEST_F(PlayerTest, StopsWhenTold) {
  CanTrack four = track(4);
  const auto send = [&](const can::Frame&) {
    stop_ = true;
    return SendVerdict::kSent;
  };
  EXPECT_EQ(play_can(four, faults_, send, Pacer(1.0), stop_).frames, 1U);
}

TEST(Pacer, LaysTheTimeLineOntoThePresent) {
  const auto unix_now_ns = [] {
    return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  };
  const std::int64_t before_ns = unix_now_ns();
  const Pacer pacer(2.0);
  const std::int64_t start_ns = pacer.unix_ns(0);
  EXPECT_GT(start_ns, before_ns);
  // At twice the speed, a second of the drive is half a second; clocks are read one after another.
  EXPECT_NEAR(static_cast<double>(pacer.unix_ns(1'000'000'000) - start_ns), 0.5e9, 0.1e9);
  std::atomic<bool> stop = false;
  EXPECT_TRUE(pacer.wait_until(10'000'000, stop));
  EXPECT_GE(pacer.late_ns(10'000'000), 0);
  EXPECT_GE(unix_now_ns(), start_ns);
  stop = true;
  EXPECT_FALSE(pacer.wait_until(3'600'000'000'000, stop));
}

TEST(Lateness, TellsQuantilesAndCountsWhatIsLate) {
  Lateness lateness;
  for (int i = 1; i <= 100; ++i) {
    lateness.add(i * 100'000);  // 0.1 to 10 ms
  }
  EXPECT_EQ(lateness.count(), 100U);
  EXPECT_EQ(lateness.late_count(), 50U);
  EXPECT_EQ(lateness.max_ns(), 10'000'000);
  EXPECT_NEAR(static_cast<double>(lateness.quantile_ns(0.5)), 5e6, 2e4);
  EXPECT_NEAR(static_cast<double>(lateness.quantile_ns(0.99)), 9.9e6, 2e4);
  lateness.add(3'000'000'000);
  EXPECT_EQ(lateness.quantile_ns(1.0), 3'000'000'000);
  lateness.add(-5);
  EXPECT_EQ(Lateness().quantile_ns(0.5), 0);
}

TEST(BlackImage, KeepsSizeAndFormat) {
  image_t image = testing::jpeg_image(77, cv::Mat(16, 32, CV_8UC1, cv::Scalar(200)));
  for (const bool jpeg : {true, false}) {
    if (!jpeg) {
      image.pixelformat = transport::kPixelFormatGray;
      image.row_stride = 40;
      image.data.assign(40 * 16, 200);
      image.size = 40 * 16;
    }
    std::vector<std::byte> bytes(static_cast<std::size_t>(image.getEncodedSize()));
    image.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    const auto black = black_image(bytes);
    transport::ImageView view;
    ASSERT_EQ(transport::view_image(black, view), transport::ImageVerdict::kOk);
    EXPECT_EQ(view.width_px, 32);
    EXPECT_EQ(view.height_px, 16);
    EXPECT_EQ(view.pixelformat, image.pixelformat);
    auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(view.data.data()));
    const cv::Mat pixels =
        jpeg ? cv::imdecode(cv::Mat(1, static_cast<int>(view.data.size()), CV_8UC1, data),
                            cv::IMREAD_GRAYSCALE)
             : cv::Mat(16, 32, CV_8UC1, data, 40);
    double largest = 0.0;
    cv::minMaxLoc(pixels, nullptr, &largest);
    EXPECT_EQ(largest, 0.0);
  }
}

}  // namespace
}  // namespace topoloc::replay
