// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/v4l2_camera.hpp"

#include "topoloc/camera/camera_list.hpp"
#include "topoloc/transport/image_view.hpp"

#include "fake_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::camera {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kWait_ms = 50;

CameraRequest request() {
  CameraRequest request;
  request.device = "/dev/video0";
  return request;
}

std::string error_of(FakeCamera& driver, const CameraRequest& wanted) {
  try {
    const V4l2Camera camera(driver, wanted);
  } catch (const CameraError& e) {
    EXPECT_EQ(driver.open_now, 0);
    EXPECT_EQ(driver.mapped, 0);
    return e.what();
  }
  return "none";
}

/// Unix microseconds of a moment `before_ms` before the driver's present.
std::int64_t unix_us(const FakeCamera& driver, double before_ms) {
  return (driver.now + driver.ahead) / 1000 - static_cast<std::int64_t>(before_ms * 1000.0);
}

TEST(PixelLayout, CheapestUsableFormatIsTakenUnlessOneIsWanted) {
  const std::vector<std::uint32_t> all = {V4L2_PIX_FMT_H264, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG,
                                          V4L2_PIX_FMT_GREY};
  EXPECT_EQ(choose_layout(all, std::nullopt), PixelLayout::kGrey);
  EXPECT_EQ(choose_layout(std::span(all).first(3), std::nullopt), PixelLayout::kMjpeg);
  EXPECT_EQ(choose_layout(all, PixelLayout::kYuyv), PixelLayout::kYuyv);
  EXPECT_EQ(choose_layout(std::span(all).first(1), std::nullopt), std::nullopt);
  EXPECT_EQ(choose_layout(std::span(all).first(2), PixelLayout::kMjpeg), std::nullopt);
}

TEST(PixelLayout, CodesAreShownAsLetters) {
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_MJPEG), "MJPG");
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y16), "Y16.");
}

TEST(V4l2Camera, StreamsGreyImagesWithoutTheirPadding) {
  FakeCamera driver;
  driver.padding = 8;
  {
    V4l2Camera camera(driver, request());
    EXPECT_EQ(camera.mode().layout, PixelLayout::kGrey);
    EXPECT_EQ(camera.mode().size, (ImageSize{.width_px = 8, .height_px = 4}));
    EXPECT_EQ(camera.mode().fps, 10.0);
    EXPECT_TRUE(driver.streaming);
    EXPECT_EQ(driver.queued.size(), 4U);
    for (std::uint32_t i = 0; i < 20; ++i) {
      driver.send(i, driver.pixels(static_cast<std::uint8_t>(i)));
      image_t image{};
      ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
      EXPECT_EQ(image.data, std::vector<std::uint8_t>(8 * 4, static_cast<std::uint8_t>(i)));
      EXPECT_EQ(image.pixelformat, transport::kPixelFormatGray);
      EXPECT_EQ(image.row_stride, 8);
      EXPECT_EQ(driver.queued.size(), 4U);  // the buffer went back
    }
    EXPECT_EQ(camera.dropped(), 0U);
  }
  EXPECT_FALSE(driver.streaming);
  EXPECT_EQ(driver.open_now, 0);
  EXPECT_EQ(driver.mapped, 0);
}

TEST(V4l2Camera, YuyvBecomesGrey) {
  FakeCamera driver;
  driver.codes = {V4L2_PIX_FMT_YUYV};
  V4l2Camera camera(driver, request());
  auto pixels = driver.pixels(200);
  for (std::size_t i = 1; i < pixels.size(); i += 2) {
    pixels[i] = 128;  // no colour
  }
  driver.send(0, pixels);
  image_t image{};
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.data, std::vector<std::uint8_t>(8 * 4, 200));
}

TEST(V4l2Camera, JpegFramesGoOnAsTheyAreAndThoseOfAnotherSizeAreDamaged) {
  FakeCamera driver;
  driver.codes = {V4L2_PIX_FMT_MJPEG};
  V4l2Camera camera(driver, request());
  std::vector<std::uint8_t> file;
  cv::imencode(".jpg", cv::Mat(4, 8, CV_8UC1, cv::Scalar(9)), file);
  image_t image{};
  driver.send(0, file);
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.data, file);
  EXPECT_EQ(image.pixelformat, transport::kPixelFormatMjpeg);
  driver.send(1, {file.begin(), file.begin() + 20});
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kDamaged);
  cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC1, cv::Scalar(9)), file);
  driver.send(2, file);
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kDamaged);
}

TEST(V4l2Camera, StampOfTheStartOfExposureIsMovedToItsMiddle) {
  FakeCamera driver;
  driver.controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, 80}};  // 8 ms
  V4l2Camera camera(driver, request());
  EXPECT_THAT(camera.warnings(), IsEmpty());
  driver.send(0, driver.pixels(1), 20);
  image_t image{};
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.utime, unix_us(driver, 20 - 4));
}

TEST(V4l2Camera, StampOfTheEndOfTheFrameIsMovedBackToTheMiddleOfTheExposure) {
  FakeCamera driver;
  driver.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, 80}};
  CameraRequest wanted = request();
  wanted.stamp_offset_ns = -3'000'000;
  V4l2Camera camera(driver, wanted);
  driver.send(0, driver.pixels(1), 20);
  driver.frames.back().flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  image_t image{};
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.utime, unix_us(driver, 20 + 4 + 3));
}

TEST(V4l2Camera, StampFollowsTheSystemClockWhenThatIsSet) {
  FakeCamera driver;
  CameraRequest wanted = request();
  wanted.exposure_ns = 0;
  V4l2Camera camera(driver, wanted);
  driver.send(0, driver.pixels(1), 0);
  driver.ahead += 3'600'000'000'000;
  image_t image{};
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.utime, unix_us(driver, 0));
}

TEST(V4l2Camera, ChangedExposureIsNoticed) {
  FakeCamera driver;
  driver.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, 80}};
  V4l2Camera camera(driver, request());
  driver.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = 20;
  image_t image{};
  for (std::uint32_t i = 0; i < 12; ++i) {  // 1.2 s
    driver.send(i, driver.pixels(1), 20);
    ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  }
  EXPECT_EQ(image.utime, unix_us(driver, 20 - 1));
}

TEST(V4l2Camera, GivenExposureServesWhereTheCameraTellsNoneThatCounts) {
  CameraRequest wanted = request();
  wanted.exposure_ns = 6'000'000;
  const std::map<std::uint32_t, std::int32_t> none;
  const std::map<std::uint32_t, std::int32_t> automatic = {
      {V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY}, {V4L2_CID_EXPOSURE_ABSOLUTE, 80}};
  for (const auto& controls : {none, automatic}) {
    FakeCamera driver;
    driver.controls = controls;
    V4l2Camera camera(driver, wanted);
    EXPECT_THAT(camera.warnings(), IsEmpty());
    driver.send(0, driver.pixels(1), 20);
    image_t image{};
    ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
    EXPECT_EQ(image.utime, unix_us(driver, 20 - 3));
  }
}

TEST(V4l2Camera, ExposureThatIsUnknownOrAutomaticIsWarnedOf) {
  FakeCamera driver;
  EXPECT_THAT(V4l2Camera(driver, request()).warnings(), ElementsAre(HasSubstr("--exposure-ms")));
  driver.controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO},
                     {V4L2_CID_EXPOSURE_ABSOLUTE, 80}};
  EXPECT_THAT(V4l2Camera(driver, request()).warnings(), ElementsAre(HasSubstr("by itself")));
}

TEST(V4l2Camera, StampByAnotherClockIsReplacedByTheTimeOfArrival) {
  FakeCamera driver;
  CameraRequest wanted = request();
  wanted.exposure_ns = 6'000'000;
  V4l2Camera camera(driver, wanted);
  driver.send(0, driver.pixels(1), 20);
  driver.frames.back().flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  image_t image{};
  ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  EXPECT_EQ(image.utime, unix_us(driver, 3));
  EXPECT_EQ(camera.stamped_on_arrival(), 1U);
}

TEST(V4l2Camera, StampsThatCannotBeAreRefused) {
  FakeCamera driver;
  V4l2Camera camera(driver, request());
  image_t image{};
  driver.send(0, driver.pixels(1), -10);  // in the future
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kBadStamp);
  driver.send(1, driver.pixels(1), 6000);  // long ago
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kBadStamp);
  driver.send(2, driver.pixels(1), 10);
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  driver.send(3, driver.pixels(1), 110);  // the same again
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kBadStamp);
}

TEST(V4l2Camera, GapsInTheNumbersAreDroppedFrames) {
  FakeCamera driver;
  V4l2Camera camera(driver, request());
  image_t image{};
  for (const std::uint32_t sequence : {0xfffffffeU, 0xffffffffU, 0U, 3U, 4U, 10U, 0U, 1U}) {
    driver.send(sequence, driver.pixels(1));
    ASSERT_EQ(camera.capture(image, kWait_ms), Capture::kImage);
  }
  EXPECT_EQ(camera.dropped(), 2U + 5U);
}

TEST(V4l2Camera, FramesThatTheDriverMarksOrCutsShortAreDamaged) {
  FakeCamera driver;
  V4l2Camera camera(driver, request());
  image_t image{};
  driver.send(0, driver.pixels(1));
  driver.frames.back().flags |= V4L2_BUF_FLAG_ERROR;
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kDamaged);
  driver.send(1, std::vector<std::uint8_t>(20, 1));
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kDamaged);
  driver.send(2, {});
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kDamaged);
  EXPECT_EQ(driver.queued.size(), 4U);
}

TEST(V4l2Camera, WithoutAFrameItWaitsItsTime) {
  FakeCamera driver;
  V4l2Camera camera(driver, request());
  image_t image{};
  const std::int64_t before = driver.now;
  EXPECT_EQ(camera.capture(image, kWait_ms), Capture::kTimeout);
  EXPECT_EQ(driver.now - before, kWait_ms * 1'000'000);
}

TEST(V4l2Camera, ErrorsNameTheDeviceAndWhatToDo) {
  FakeCamera driver;
  driver.plugged = false;
  EXPECT_THAT(error_of(driver, request()), AllOf(HasSubstr("/dev/video0: "), HasSubstr("--list")));
  driver.plugged = true;
  driver.open_error = EACCES;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("group video"));
  driver.open_error = EBUSY;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("another program uses it"));
  driver.open_error = 0;
  driver.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("gives no images"));
  driver.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("multi-planar"));
  driver.capabilities = V4L2_CAP_VIDEO_CAPTURE;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("no streaming"));
}

TEST(V4l2Camera, WhatTheCameraDoesNotOfferIsAnErrorThatListsWhatItDoes) {
  FakeCamera driver;
  CameraRequest wanted = request();
  wanted.layout = PixelLayout::kMjpeg;
  EXPECT_THAT(error_of(driver, wanted), HasSubstr("has no MJPG images; it offers: YUYV, GREY"));
  wanted.layout = PixelLayout::kGrey;
  wanted.width_px = 6;
  wanted.height_px = 4;
  EXPECT_THAT(error_of(driver, wanted),
              AllOf(HasSubstr("has no GREY of 6x4"), HasSubstr("it offers: 8x4, 4x2")));
  driver.most_buffers = 1;
  EXPECT_THAT(error_of(driver, request()), HasSubstr("less than two buffers"));
}

TEST(V4l2Camera, AnotherRateThanAskedForIsWarnedOf) {
  FakeCamera driver;
  CameraRequest wanted = request();
  wanted.fps = 25.0;
  wanted.exposure_ns = 0;
  EXPECT_THAT(V4l2Camera(driver, wanted).warnings(),
              ElementsAre(HasSubstr("gives 10.00 images a second instead of 25")));
}

TEST(CameraList, SaysWhatEachDeviceOffers) {
  FakeCamera driver;
  driver.codes.push_back(V4L2_PIX_FMT_H264);
  const auto cameras = list_cameras(driver);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].name, "Fake camera");
  EXPECT_EQ(cameras[0].bus, "usb-1");
  ASSERT_EQ(cameras[0].formats.size(), 3U);
  EXPECT_EQ(cameras[0].formats[1].name, "GREY");
  EXPECT_TRUE(cameras[0].formats[1].usable);
  EXPECT_EQ(cameras[0].formats[1].sizes, "8x4, 4x2");
  EXPECT_FALSE(cameras[0].formats[2].usable);
  EXPECT_EQ(driver.open_now, 0);
}

TEST(CameraList, DeviceThatMayNotBeOpenedIsListedWithTheReason) {
  FakeCamera driver;
  driver.open_error = EACCES;
  const auto cameras = list_cameras(driver);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_THAT(cameras[0].problem, HasSubstr("group video"));
}

}  // namespace
}  // namespace topoloc::camera
