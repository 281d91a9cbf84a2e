// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_bridge.hpp"

#include "topoloc/camera/image_folder.hpp"
#include "topoloc/camera/played_images.hpp"
#include "topoloc/camera/video_file.hpp"
#include "topoloc/transport/image_view.hpp"

#include "support/temporary_folder.hpp"

#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

namespace topoloc::camera {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;
using topoloc::testing::TemporaryFolder;

constexpr double kFast = 1000.0;  // images per second

std::int64_t unix_now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Takes in what is published on an LCM of its own, and checks it as the localiser does.
class Receiver {
 public:
  Receiver() { lcm_.subscribe("CAMERA", &Receiver::take, this); }

  BridgeSummary publish(ImageSource& source, const BridgeConfig& config = {}) {
    const std::atomic<bool> stop = false;
    return publish_images(
        source, config,
        [&](std::span<const std::byte> message) {
          const bool published =
              lcm_.publish("CAMERA", message.data(), static_cast<unsigned>(message.size())) == 0;
          return published && lcm_.handleTimeout(1000) > 0;
        },
        stop);
  }

  struct Image {
    transport::ImageView view;
    std::vector<std::byte> data;
  };
  std::vector<Image> images;
  std::vector<transport::ImageVerdict> refused;

 private:
  void take(const lcm::ReceiveBuffer* buffer, const std::string&) {
    Image image;
    const auto verdict = transport::view_image(
        {static_cast<const std::byte*>(buffer->data), buffer->data_size}, image.view);
    if (verdict != transport::ImageVerdict::kOk) {
      refused.push_back(verdict);
      return;
    }
    image.data.assign(image.view.data.begin(), image.view.data.end());
    images.push_back(image);
  }

  lcm::LCM lcm_{"memq://"};
};

void write_images(const TemporaryFolder& folder, int count, const std::string& extension) {
  for (int i = 0; i < count; ++i) {
    cv::imwrite((folder / (std::to_string(i) + extension)).string(),
                cv::Mat(48, 64, CV_8UC1, cv::Scalar(20 * i)));
  }
}

PlayedImages play_folder(const TemporaryFolder& folder, const PlayedImages::Config& config = {},
                         std::vector<std::string>* reports = nullptr) {
  return {std::make_unique<FolderImages>(list_images(folder / "")), ImageTimes(kFast), config,
          [reports](const std::string& line) {
            if (reports != nullptr) {
              reports->push_back(line);
            }
          }};
}

TEST(ImageBridge, FolderArrivesOverLcmWholeAndInOrder) {
  const TemporaryFolder folder;
  write_images(folder, 12, ".png");
  PlayedImages source = play_folder(folder);
  Receiver receiver;
  const std::int64_t before_us = unix_now_us();
  const BridgeSummary summary = receiver.publish(source);
  const std::int64_t after_us = unix_now_us();

  EXPECT_EQ(summary.published, 12U);
  EXPECT_TRUE(receiver.refused.empty());
  ASSERT_EQ(receiver.images.size(), 12U);
  std::int64_t last_us = before_us - 1000;
  for (std::size_t i = 0; i < 12; ++i) {
    const auto& image = receiver.images[i];
    EXPECT_EQ(image.view.width_px, 64);
    EXPECT_EQ(image.view.height_px, 48);
    EXPECT_EQ(image.view.pixelformat, transport::kPixelFormatGray);
    EXPECT_EQ(image.data, std::vector<std::byte>(64 * 48, static_cast<std::byte>(20 * i)));
    EXPECT_GT(image.view.time_us, last_us);
    EXPECT_LE(image.view.time_us, after_us);
    last_us = image.view.time_us;
  }
  EXPECT_NEAR(summary.rate_hz(), kFast, 1.0);  // of the stamps: due times, however late it was
}

TEST(ImageBridge, JpegFilesGoOutUnchangedUnlessGreyIsAskedFor) {
  const TemporaryFolder folder;
  write_images(folder, 1, ".jpg");
  Receiver receiver;
  PlayedImages as_is = play_folder(folder);
  receiver.publish(as_is);
  PlayedImages decoded = play_folder(folder);
  receiver.publish(decoded, {.form = ImageForm::kGrey});
  ASSERT_EQ(receiver.images.size(), 2U);
  EXPECT_EQ(receiver.images[0].view.pixelformat, transport::kPixelFormatMjpeg);
  EXPECT_EQ(receiver.images[0].data.size(), std::filesystem::file_size(folder / "0.jpg"));
  EXPECT_EQ(receiver.images[1].view.pixelformat, transport::kPixelFormatGray);
  EXPECT_EQ(receiver.images[1].data.size(), 64U * 48U);
}

TEST(ImageBridge, RecordedStampsAreKeptWhereAskedForAndShifted) {
  const TemporaryFolder folder;
  write_images(folder, 2, ".png");
  PlayedImages source(std::make_unique<FolderImages>(list_images(folder / "")),
                      ImageTimes({{1'000'000'000'000, ""}, {1'000'001'000'000, ""}}),
                      {.loop = false, .keep_stamps = true, .offset_ns = -500'000},
                      [](const std::string&) {});
  Receiver receiver;
  receiver.publish(source);
  ASSERT_EQ(receiver.images.size(), 2U);
  EXPECT_EQ(receiver.images[0].view.time_us, 999'999'500);
  EXPECT_EQ(receiver.images[1].view.time_us, 1'000'000'500);
}

TEST(ImageBridge, UnreadableFilesAreCountedAndKeepTheirPlaceInTime) {
  const TemporaryFolder folder;
  write_images(folder, 3, ".png");
  (void)folder.with("1.png", "damaged");
  std::vector<std::string> reports;
  PlayedImages source = play_folder(folder, {}, &reports);
  Receiver receiver;
  receiver.publish(source);
  ASSERT_EQ(receiver.images.size(), 2U);
  EXPECT_EQ(receiver.images[1].view.time_us - receiver.images[0].view.time_us, 2000);
  EXPECT_THAT(source.losses(), ElementsAre(Pair("unreadable", 1), Pair("without_stamp", 0)));
  EXPECT_THAT(reports, ElementsAre(::testing::HasSubstr("1.png: cannot be read")));
}

TEST(ImageBridge, LoopGoesOnWithStampsThatGoOn) {
  const TemporaryFolder folder;
  write_images(folder, 3, ".png");
  PlayedImages source = play_folder(folder, {.loop = true});
  image_t image{};
  std::int64_t last_us = 0;
  for (int left = 10; left > 0;) {
    if (source.next(image) == Taken::kImage) {
      if (last_us != 0) {
        EXPECT_NEAR(static_cast<double>(image.utime - last_us), 1000.0, 1.0);
      }
      last_us = image.utime;
      --left;
    }
  }
}

TEST(ImageBridge, LoopOverNothingReadableEnds) {
  const TemporaryFolder folder;
  (void)folder.with("1.png", "damaged");
  PlayedImages source = play_folder(folder, {.loop = true});
  Receiver receiver;
  EXPECT_EQ(receiver.publish(source).published, 0U);
}

TEST(ImageBridge, ImagesThatLcmDoesNotTakeAreCounted) {
  const TemporaryFolder folder;
  write_images(folder, 3, ".png");
  PlayedImages source = play_folder(folder);
  const std::atomic<bool> stop = false;
  const BridgeSummary summary = publish_images(
      source, {}, [](std::span<const std::byte>) { return false; }, stop);
  EXPECT_EQ(summary.published, 0U);
  EXPECT_EQ(summary.failed, 3U);
}

TEST(ImageBridge, VideoArrivesAsGrey) {
  const TemporaryFolder folder;
  const auto file = folder / "video.avi";
  cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25.0,
                         cv::Size(64, 48));
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < 5; ++i) {
    writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar(40 * i, 40 * i, 40 * i)));
  }
  writer.release();

  auto video = std::make_unique<VideoImages>(file);
  EXPECT_NEAR(video->fps(), 25.0, 1e-3);
  PlayedImages source(std::move(video), ImageTimes(kFast), {}, [](const std::string&) {});
  Receiver receiver;
  receiver.publish(source);
  ASSERT_EQ(receiver.images.size(), 5U);
  EXPECT_EQ(receiver.images[3].view.width_px, 64);
  EXPECT_NEAR(std::to_integer<int>(receiver.images[3].data[1000]), 120, 3);
}

TEST(ImageBridge, WhatIsNoVideoIsAnErrorThatNamesIt) {
  const TemporaryFolder folder;
  const auto text = folder.with("video.mp4", "no video");
  EXPECT_THAT([&] { VideoImages video(text); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("not a video")));
  EXPECT_THAT([&] { VideoImages video(folder / "none.mp4"); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("no such video")));
}

}  // namespace
}  // namespace topoloc::camera
