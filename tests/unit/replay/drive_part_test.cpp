// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/drive_part.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::replay {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kMillisecond_ns = 1'000'000;

class DrivePartTest : public ::testing::Test {
 protected:
  /// Frames numbered from zero at these times in milliseconds.
  std::filesystem::path log(const std::vector<std::int64_t>& times_ms) {
    std::string text;
    for (std::size_t i = 0; i < times_ms.size(); ++i) {
      can::Frame frame;
      frame.time_ns = kStart_ns + times_ms[i] * kMillisecond_ns;
      frame.id = 0x100;
      frame.length = 1;
      frame.data[0] = static_cast<std::uint8_t>(i);
      frame.set_interface(i % 2 == 0 ? "can0" : "can1");
      text += can::format_candump_line(frame) + "\n";
    }
    return folder_.with("can.log", text);
  }
  static DrivePart part(std::int64_t begin_ms, std::int64_t end_ms, bool loop = false) {
    return {.begin_ns = kStart_ns + begin_ms * kMillisecond_ns,
            .end_ns = kStart_ns + end_ms * kMillisecond_ns,
            .loop = loop};
  }
  /// Up to `most` items as number and time in milliseconds.
  static std::vector<std::pair<int, std::int64_t>> played(CanTrack track, int most = 100) {
    std::vector<std::pair<int, std::int64_t>> all;
    for (TimedFrame next; most > 0 && track.next(next); --most) {
      all.emplace_back(next.frame.data[0], next.elapsed_ns / kMillisecond_ns);
    }
    return all;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(DrivePartTest, SummarisesALog) {
  const auto summary = summarise_can_log(log({0, 10, 30}), 0.0);
  EXPECT_EQ(summary.first_ns, kStart_ns);
  EXPECT_EQ(summary.last_ns, kStart_ns + 30 * kMillisecond_ns);
  EXPECT_THAT(summary.frames, ElementsAre(::testing::Pair("can0", 2), ::testing::Pair("can1", 1)));
}

TEST_F(DrivePartTest, RefusesPartsWithoutOneTimeLine) {
  const auto file = log({0, 10, 5000, 3000, 3010, 100'000});
  const auto refused = [&](double start_s, const std::string& why) {
    EXPECT_THAT([&] { summarise_can_log(file, start_s); },
                ThrowsMessage<std::runtime_error>(HasSubstr(why)));
  };
  refused(0.0, "the time goes back by 2.000 s");
  refused(200.0, "the log ends before the start asked for");
  EXPECT_NO_THROW(summarise_can_log(file, 0.0, 1.0)) << "what is not played does not matter";
  const auto leap = log({0, 10, 100'000});
  EXPECT_THAT([&] { summarise_can_log(leap, 0.0); },
              ThrowsMessage<std::runtime_error>(HasSubstr("leaps ahead by 99.990 s")));
}

TEST_F(DrivePartTest, PlaysThePartOnly) {
  EXPECT_THAT(played(CanTrack(log({0, 10, 20, 30}), part(10, 30))),
              ElementsAre(std::pair(1, 0), std::pair(2, 10)));
}

TEST_F(DrivePartTest, FramesThatAreLoggedLateAreDueWithTheOneBefore) {
  EXPECT_THAT(played(CanTrack(log({0, 20, 15, 30}), part(0, 100))),
              ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(2, 20), std::pair(3, 30)));
}

TEST_F(DrivePartTest, LoopsGoOnInTime) {
  EXPECT_THAT(played(CanTrack(log({0, 10, 20}), part(10, 20, true)), 3),
              ElementsAre(std::pair(1, 0), std::pair(1, 20), std::pair(1, 40)))
      << "10 ms long, and 10 ms from one lap to the next";
}

TEST_F(DrivePartTest, ALoopOfNothingEnds) {
  EXPECT_TRUE(played(CanTrack(log({0, 10}), part(50, 60, true))).empty());
}

class CameraTrackTest : public DrivePartTest {
 protected:
  CameraTrackTest()
      : drive_(
            folder_ / "drive",
            {.width_px = 32, .height_px = 16, .fx_px = 50, .fy_px = 50, .cx_px = 16, .cy_px = 8}) {
    transport::LcmLogWriter log(drive_ / "camera.lcm");
    for (int i = 0; i < 5; ++i) {  // every 100 ms, logged 30 ms after exposure; the last has no
                                   // sensible log time
      const std::int64_t time_us = kStart_ns / 1000 + i * 100'000;
      const image_t image =
          testing::jpeg_image(time_us, cv::Mat(16, 32, CV_8UC1, cv::Scalar(50 * i)));
      std::vector<std::byte> bytes(static_cast<std::size_t>(image.getEncodedSize()));
      image.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      log.write(i == 4 ? 1 : time_us + 30'000, "CAMERA", bytes);
    }
    log.close();
    images_.emplace(drive_ / "camera.lcm", "CAMERA", cv::Size(32, 16), 0);
  }
  /// Arrival and stamp in milliseconds.
  static std::vector<std::pair<std::int64_t, std::int64_t>> played(CameraTrack track, int most) {
    std::vector<std::pair<std::int64_t, std::int64_t>> all;
    for (TimedImage next; most > 0 && track.next(next); --most) {
      all.emplace_back(next.elapsed_ns / kMillisecond_ns, next.stamp_ns / kMillisecond_ns);
    }
    return all;
  }

  testing::DriveFolder drive_;
  std::optional<drive::FrameLog> images_;
};

TEST_F(CameraTrackTest, ImagesComeWhenTheyWereLoggedWithTheStampOfTheirExposure) {
  EXPECT_THAT(played(CameraTrack(*images_, part(0, 1000), drive::FrameSelection::kAll), 100),
              ElementsAre(std::pair(30, 0), std::pair(130, 100), std::pair(230, 200),
                          std::pair(330, 300), std::pair(400, 400)));
}

TEST_F(CameraTrackTest, SelectsByPlaceInTheLogWhateverThePart) {
  EXPECT_THAT(played(CameraTrack(*images_, part(50, 1000), drive::FrameSelection::kOdd), 100),
              ElementsAre(std::pair(80, 50), std::pair(280, 250)));
}

TEST_F(CameraTrackTest, LoopsGoOnInTime) {
  EXPECT_THAT(
      played(CameraTrack(*images_, part(0, 190, true), drive::FrameSelection::kAll), 4),
      ElementsAre(std::pair(30, 0), std::pair(130, 100), std::pair(230, 200), std::pair(330, 300)));
}

TEST_F(CameraTrackTest, FindsImagesOfOtherPlaces) {
  const CameraTrack track(*images_, part(100, 1000), drive::FrameSelection::kEven);
  EXPECT_EQ(track.message_at(99 * kMillisecond_ns).data(), images_->message(1).data.data());
  EXPECT_EQ(track.message_at(100 * kMillisecond_ns).data(), images_->message(2).data.data());
  EXPECT_EQ(track.message_at(3'600'000 * kMillisecond_ns).data(), images_->message(4).data.data());
  EXPECT_TRUE(track.message_at(-101 * kMillisecond_ns).empty());
}

}  // namespace
}  // namespace topoloc::replay
