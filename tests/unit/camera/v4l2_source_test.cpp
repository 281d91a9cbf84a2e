// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/v4l2_source.hpp"

#include "fake_camera.hpp"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::camera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class V4l2SourceTest : public ::testing::Test {
 protected:
  V4l2SourceTest() {
    request_.device = "/dev/video0";
    request_.exposure_ns = 0;
  }

  V4l2Source source() {
    return {driver_, request_, [this](const std::string& line) { reports_.push_back(line); }};
  }

  /// Frames numbered from `first`; how many came through.
  int stream(V4l2Source& source, std::uint32_t first, int count) {
    int images = 0;
    for (int i = 0; i < count; ++i) {
      driver_.send(first + static_cast<std::uint32_t>(i), driver_.pixels(7));
      images += source.next(image_) == Taken::kImage ? 1 : 0;
    }
    return images;
  }

  /// Asks for images for so long.
  void idle(V4l2Source& source, std::int64_t duration_ns) {
    for (const std::int64_t end = driver_.now + duration_ns; driver_.now < end;) {
      ASSERT_EQ(source.next(image_), Taken::kNothing);
    }
  }

  static std::map<std::string, std::uint64_t> losses(const V4l2Source& source) {
    const auto list = source.losses();
    return {list.begin(), list.end()};
  }

  FakeCamera driver_;
  CameraRequest request_;
  std::vector<std::string> reports_;
  image_t image_{};
};

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST_F(V4l2SourceTest, CameraThatIsNotThereAtTheStartIsAnError) {
  driver_.plugged = false;
  EXPECT_THROW((void)source(), CameraError);
}

TEST_F(V4l2SourceTest, UnpluggedCameraIsUsedAgainOnceItIsBack) {
  V4l2Source camera = source();
  EXPECT_EQ(stream(camera, 0, 5), 5);
  driver_.plugged = false;
  idle(camera, 3 * kSecond_ns);
  EXPECT_EQ(driver_.open_now, 0);  // else the device file could not have its name again
  EXPECT_EQ(driver_.mapped, 0);
  EXPECT_THAT(reports_, ElementsAre(HasSubstr("waiting for it to come back"),
                                    HasSubstr("still waiting: /dev/video0")));
  driver_.plugged = true;
  driver_.frames.clear();
  idle(camera, kSecond_ns);
  EXPECT_THAT(reports_.back(), HasSubstr("is back"));
  EXPECT_EQ(stream(camera, 0, 5), 5);
  EXPECT_EQ(losses(camera)["interruptions"], 1U);
  EXPECT_EQ(losses(camera)["dropped"], 0U);  // its numbers begin anew
  EXPECT_EQ(driver_.opened, 2);
}

TEST_F(V4l2SourceTest, CameraIsTriedTwiceASecondNotMore) {
  V4l2Source camera = source();
  driver_.plugged = false;
  idle(camera, kSecond_ns / 10);
  driver_.plugged = true;
  driver_.open_error = EACCES;  // udev has not set the permissions yet
  idle(camera, 2 * kSecond_ns);
  EXPECT_THAT(reports_.back(), HasSubstr("group video"));
  EXPECT_LE(reports_.size(), 3U);
  driver_.open_error = 0;
  idle(camera, kSecond_ns);
  EXPECT_EQ(driver_.opened, 2);
}

TEST_F(V4l2SourceTest, DriverThatGivesUpIsStartedAgain) {
  V4l2Source camera = source();
  EXPECT_EQ(stream(camera, 0, 2), 2);
  driver_.dequeue_error = EIO;
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  driver_.dequeue_error = 0;
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  EXPECT_EQ(stream(camera, 0, 2), 2);
  EXPECT_EQ(losses(camera)["interruptions"], 1U);
}

TEST_F(V4l2SourceTest, CameraWithoutImagesForTwoSecondsIsStartedAgain) {
  V4l2Source camera = source();
  EXPECT_EQ(stream(camera, 0, 2), 2);
  idle(camera, kSecond_ns);
  EXPECT_EQ(driver_.opened, 1);
  idle(camera, 2 * kSecond_ns);
  EXPECT_EQ(driver_.opened, 2);
  EXPECT_THAT(reports_, ElementsAre(HasSubstr("no image for"), HasSubstr("is back")));
  EXPECT_EQ(stream(camera, 0, 2), 2);
}

TEST_F(V4l2SourceTest, SlowCameraMayTakeFivePeriods) {
  driver_.fps = 1;
  V4l2Source camera = source();
  idle(camera, 4 * kSecond_ns);
  EXPECT_EQ(driver_.opened, 1);
}

TEST_F(V4l2SourceTest, AnotherCameraInItsPlaceIsNotTaken) {
  V4l2Source camera = source();
  driver_.plugged = false;
  idle(camera, kSecond_ns);
  driver_.plugged = true;
  driver_.sizes = {{16, 8}};
  driver_.format.width = 16;
  driver_.format.height = 8;
  idle(camera, 2 * kSecond_ns);
  EXPECT_THAT(reports_.back(), HasSubstr("has no GREY of 8x4"));
  EXPECT_EQ(driver_.open_now, 0);
}

TEST_F(V4l2SourceTest, LossesAddUpOverInterruptions) {
  V4l2Source camera = source();
  EXPECT_EQ(stream(camera, 0, 1), 1);
  EXPECT_EQ(stream(camera, 3, 1), 1);
  driver_.dequeue_error = EIO;
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  driver_.dequeue_error = 0;
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  EXPECT_EQ(stream(camera, 0, 1), 1);
  EXPECT_EQ(stream(camera, 2, 1), 1);
  driver_.send(3, {});
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  driver_.send(4, driver_.pixels(1), -10);
  EXPECT_EQ(camera.next(image_), Taken::kNothing);
  EXPECT_THAT(losses(camera),
              ElementsAre(::testing::Pair("bad_stamp", 1), ::testing::Pair("damaged", 1),
                          ::testing::Pair("dropped", 3), ::testing::Pair("interruptions", 1),
                          ::testing::Pair("stamped_on_arrival", 0)));
}

}  // namespace
}  // namespace topoloc::camera
