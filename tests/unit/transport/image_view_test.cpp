// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/image_view.hpp"

#include "topoloc/image_t.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::transport {
namespace {

image_t gray_image() {
  image_t image{};
  image.utime = 1'317'045'935'622'616;
  image.width = 6;
  image.height = 4;
  image.row_stride = 8;
  image.pixelformat = kPixelFormatGray;
  image.size = 32;
  image.data.assign(32, 9);
  image.nmetadata = 1;
  image.metadata.resize(1);
  image.metadata[0].key = "exposure";
  image.metadata[0].n = 1;
  image.metadata[0].value = {7};
  return image;
}

std::vector<std::byte> encoded(const image_t& image) {
  std::vector<std::byte> message(static_cast<std::size_t>(image.getEncodedSize()));
  EXPECT_GT(image.encode(message.data(), 0, static_cast<int>(message.size())), 0);
  return message;
}

ImageVerdict verdict(const image_t& image) {
  const auto message = encoded(image);
  ImageView view;
  return view_image(message, view);
}

TEST(ImageView, ReadsWhatTheGeneratedTypeWrites) {
  const auto message = encoded(gray_image());
  ImageView view;
  ASSERT_EQ(view_image(message, view), ImageVerdict::kOk);
  EXPECT_EQ(view.time_us, 1'317'045'935'622'616);
  EXPECT_EQ(view.width_px, 6);
  EXPECT_EQ(view.height_px, 4);
  EXPECT_EQ(view.row_stride_bytes, 8);
  ASSERT_EQ(view.data.size(), 32U);
  EXPECT_EQ(view.data[31], std::byte{9});
}

TEST(ImageView, MessageCutOffBeforeItsDataEndsIsTruncated) {
  const auto message = encoded(gray_image());
  ImageView view;
  for (std::size_t size = 0; size < 36 + 32 + 4; ++size) {
    EXPECT_EQ(view_image(std::span(message).first(size), view), ImageVerdict::kTruncated) << size;
  }
}

TEST(ImageView, WrongSizesAreNamed) {
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  for (const std::int32_t bad : {0, -1, kMaxImageSide_px + 1, kMost, -kMost}) {
    image_t wide = gray_image();
    wide.width = bad;
    EXPECT_EQ(verdict(wide), ImageVerdict::kBadDimensions);
    image_t high = gray_image();
    high.height = bad;
    EXPECT_EQ(verdict(high), ImageVerdict::kBadDimensions);
  }
  image_t image = gray_image();
  image.row_stride = 5;
  EXPECT_EQ(verdict(image), ImageVerdict::kBadDimensions);
  image.row_stride = kMost;
  EXPECT_EQ(verdict(image), ImageVerdict::kBadSize);
  image = gray_image();
  image.height = 5;
  EXPECT_EQ(verdict(image), ImageVerdict::kBadSize);
  image.pixelformat = kPixelFormatMjpeg;
  EXPECT_EQ(verdict(image), ImageVerdict::kOk) << "a JPEG's size says nothing about its pixels";
  image.pixelformat = 0;
  EXPECT_EQ(verdict(image), ImageVerdict::kUnknownFormat);
}

TEST(ImageView, SizeFieldAndTypeAreNotBelieved) {
  auto message = encoded(gray_image());
  ImageView view;
  message[32] = std::byte{0x7F};
  EXPECT_EQ(view_image(message, view), ImageVerdict::kTruncated);
  message[32] = std::byte{0xFF};
  EXPECT_EQ(view_image(message, view), ImageVerdict::kBadSize);
  message[0] ^= std::byte{1};
  EXPECT_EQ(view_image(message, view), ImageVerdict::kOtherType);
}

TEST(ImageView, TimeIsSetInPlace) {
  auto message = encoded(gray_image());
  ImageView before;
  ASSERT_EQ(view_image(message, before), ImageVerdict::kOk);
  set_image_time(message, 1'700'000'000'123'456);
  ImageView after;
  ASSERT_EQ(view_image(message, after), ImageVerdict::kOk);
  EXPECT_EQ(after.time_us, 1'700'000'000'123'456);
  EXPECT_EQ(after.width_px, before.width_px);
  EXPECT_EQ(after.data.data(), before.data.data());
  set_image_time(std::span(message).first(15), 1);
  ASSERT_EQ(view_image(message, after), ImageVerdict::kOk);
  EXPECT_EQ(after.time_us, 1'700'000'000'123'456);
}

}  // namespace
}  // namespace topoloc::transport
