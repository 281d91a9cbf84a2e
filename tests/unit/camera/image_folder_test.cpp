// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_folder.hpp"

#include "topoloc/transport/image_view.hpp"

#include "support/temporary_folder.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::camera {
namespace {

using ::testing::ElementsAre;
using topoloc::testing::TemporaryFolder;

std::vector<std::string> names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const auto& file : files) {
    names.push_back(file.filename().string());
  }
  return names;
}

TEST(ImageFolder, NumbersInNamesCountAsNumbers) {
  std::vector<std::string> files = {"img10.png", "img9.png", "img2.png", "img010.png", "a.png"};
  std::sort(files.begin(), files.end(), name_precedes);
  EXPECT_THAT(files, ElementsAre("a.png", "img2.png", "img9.png", "img010.png", "img10.png"));
}

TEST(ImageFolder, OrderOfNamesIsStrict) {
  for (const char* name : {"", "a", "7", "img007.png"}) {
    EXPECT_FALSE(name_precedes(name, name)) << name;
  }
  EXPECT_TRUE(name_precedes("a", "a1"));
  EXPECT_FALSE(name_precedes("a1", "a"));
  EXPECT_TRUE(name_precedes("00000000000000000000000000001", "2"));
}

TEST(ImageFolder, HoldsImagesOnly) {
  const TemporaryFolder folder;
  for (const char* name : {"2.JPG", "1.png", "notes.txt", "stamps.csv"}) {
    (void)folder.with(name, "");
  }
  std::filesystem::create_directory(folder / "0.jpg");
  EXPECT_THAT(names(list_images(folder / "")), ElementsAre("1.png", "2.JPG"));
}

TEST(ImageFolder, FolderWithoutImagesIsAnErrorThatNamesIt) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { (void)list_images(folder / ""); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("no images")));
  EXPECT_THAT(
      [&] { (void)list_images(folder / "none"); },
      ::testing::ThrowsMessage<std::runtime_error>(::testing::AllOf(
          ::testing::HasSubstr((folder / "none").string()), ::testing::HasSubstr("No such file"))));
}

TEST(ImageFolder, JpegFilesComeByteForByteAndOthersAsGrey) {
  const TemporaryFolder folder;
  const cv::Mat pixels(12, 20, CV_8UC3, cv::Scalar(50, 50, 50));
  cv::imwrite((folder / "1.jpg").string(), pixels);
  cv::imwrite((folder / "2.png").string(), pixels);
  FolderImages images(list_images(folder / ""));
  image_t image{};
  ASSERT_EQ(images.next(image), Read::kImage);
  EXPECT_EQ(image.pixelformat, transport::kPixelFormatMjpeg);
  EXPECT_EQ(std::string(image.data.begin(), image.data.end()),
            topoloc::testing::bytes_of(folder / "1.jpg"));
  EXPECT_EQ(image.width, 20);
  EXPECT_EQ(image.height, 12);
  ASSERT_EQ(images.next(image), Read::kImage);
  EXPECT_EQ(image.pixelformat, transport::kPixelFormatGray);
  EXPECT_EQ(image.data, std::vector<std::uint8_t>(20 * 12, 50));
  EXPECT_EQ(images.next(image), Read::kEnd);
  images.rewind();
  EXPECT_EQ(images.next(image), Read::kImage);
}

TEST(ImageFolder, FilesThatAreNoImagesAreUnreadable) {
  const TemporaryFolder folder;
  (void)folder.with("1.jpg", "no image");
  (void)folder.with("2.png", "neither");
  FolderImages images(list_images(folder / ""));
  image_t image{};
  EXPECT_EQ(images.next(image), Read::kUnreadable);
  EXPECT_EQ(images.place(), (folder / "1.jpg").string());
  EXPECT_EQ(images.next(image), Read::kUnreadable);
  EXPECT_EQ(images.next(image), Read::kEnd);
}

}  // namespace
}  // namespace topoloc::camera
