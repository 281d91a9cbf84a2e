// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_form.hpp"

#include "topoloc/transport/image_view.hpp"

#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::camera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::uint8_t> counting(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

std::vector<std::uint8_t> jpeg(int width, int height) {
  std::vector<std::uint8_t> file;
  cv::imencode(".jpg", cv::Mat(height, width, CV_8UC1, cv::Scalar(90)), file);
  return file;
}

image_t grey_image(int width, int height) {
  image_t image{};
  image.data.assign(static_cast<std::size_t>(width * height), 90);
  set_grey(image, {.width_px = width, .height_px = height});
  return image;
}

TEST(ImageForm, PaddingBetweenRowsIsLeftOut) {
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(pack_rows(counting(12), {.width_px = 3, .height_px = 2}, 6, grey));
  EXPECT_THAT(grey, ElementsAre(0, 1, 2, 6, 7, 8));
}

TEST(ImageForm, GreyOfYuyvIsEveryOtherByte) {
  std::vector<std::uint8_t> grey;
  ASSERT_TRUE(yuyv_to_grey(counting(20), {.width_px = 4, .height_px = 2}, 10, grey));
  EXPECT_THAT(grey, ElementsAre(0, 2, 4, 6, 10, 12, 14, 16));
}

TEST(ImageForm, LastRowNeedsNoPadding) {
  std::vector<std::uint8_t> grey;
  EXPECT_TRUE(pack_rows(counting(9), {.width_px = 3, .height_px = 2}, 6, grey));
}

TEST(ImageForm, TooFewBytesAreRefused) {
  std::vector<std::uint8_t> grey;
  EXPECT_FALSE(pack_rows(counting(8), {.width_px = 3, .height_px = 2}, 6, grey));
  EXPECT_FALSE(yuyv_to_grey(counting(15), {.width_px = 4, .height_px = 2}, 8, grey));
  EXPECT_FALSE(yuyv_to_grey(counting(99), {.width_px = 4, .height_px = 2}, 7, grey));
  EXPECT_FALSE(pack_rows(counting(99), {.width_px = 0, .height_px = 2}, 6, grey));
  EXPECT_THAT(grey, IsEmpty());
}

TEST(ImageForm, SizeOfAJpegIsInItsHeader) {
  EXPECT_EQ(jpeg_size(jpeg(37, 21)), (ImageSize{.width_px = 37, .height_px = 21}));
}

TEST(ImageForm, WhatIsCutOffBeforeItsSizeIsNoJpeg) {
  const std::vector<std::uint8_t> file = jpeg(37, 21);
  ASSERT_TRUE(jpeg_size(file));
  std::size_t shortest = 0;
  while (!jpeg_size(std::span(file).first(shortest))) {
    ++shortest;
  }
  EXPECT_GT(shortest, 20U);
  EXPECT_LT(shortest, file.size());
}

TEST(ImageForm, OtherBytesAreNoJpeg) {
  EXPECT_EQ(jpeg_size({}), std::nullopt);
  EXPECT_EQ(jpeg_size(counting(200)), std::nullopt);
  const std::vector<std::uint8_t> endless = {0xff, 0xd8, 0xff, 0xe0, 0, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(jpeg_size(endless), std::nullopt);
  const std::vector<std::uint8_t> fill(200, 0xff);
  EXPECT_EQ(jpeg_size(fill), std::nullopt);
}

TEST(ImageForm, GreyBecomesAJpegOfTheSameSizeAndBack) {
  image_t image = grey_image(32, 16);
  ASSERT_TRUE(convert(image, ImageForm::kMjpeg, 95));
  EXPECT_EQ(image.pixelformat, transport::kPixelFormatMjpeg);
  EXPECT_EQ(static_cast<std::size_t>(image.size), image.data.size());
  EXPECT_EQ(jpeg_size(image.data), (ImageSize{.width_px = 32, .height_px = 16}));
  ASSERT_TRUE(convert(image, ImageForm::kGrey, 95));
  EXPECT_EQ(image.pixelformat, transport::kPixelFormatGray);
  ASSERT_EQ(image.data.size(), 32U * 16U);
  EXPECT_NEAR(image.data[100], 90, 2);
}

TEST(ImageForm, WhatIsAlreadySoStaysAsItIs) {
  image_t image = grey_image(32, 16);
  const auto pixels = image.data;
  ASSERT_TRUE(convert(image, ImageForm::kAsTheyCome, 1));
  ASSERT_TRUE(convert(image, ImageForm::kGrey, 1));
  EXPECT_EQ(image.data, pixels);
}

TEST(ImageForm, DamagedJpegCannotBecomeGrey) {
  image_t image{};
  image.data = {0xff, 0xd8, 0xff, 1, 2, 3};
  set_jpeg(image, {.width_px = 32, .height_px = 16});
  EXPECT_FALSE(convert(image, ImageForm::kGrey, 90));
}

}  // namespace
}  // namespace topoloc::camera
