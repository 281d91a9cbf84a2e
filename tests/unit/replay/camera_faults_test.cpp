// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/camera_faults.hpp"

#include "support/temporary_folder.hpp"

#include <array>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::replay {
namespace {

using ::testing::ElementsAre;

/// Images 0, 1, 2, ... every 100 ms, exposed 20 ms before they come.
class CameraFaultsTest : public ::testing::Test {
 protected:
  static constexpr std::int64_t kMillisecond_ns = 1'000'000;

  CameraFaultsTest() {
    for (std::size_t i = 0; i < messages_.size(); ++i) {
      messages_[i] = static_cast<std::byte>(i);
    }
  }

  std::vector<TimedImage> run(const std::string& faults, int count) {
    const FaultScript script =
        load_fault_script(folder_.with("faults.yaml", "format: 1\nfaults:\n" + faults), {});
    CameraFaults camera(script, [this](std::int64_t elapsed_ns) {
      return elapsed_ns < 0 ? std::span<const std::byte>{}
                            : message(elapsed_ns / (100 * kMillisecond_ns));
    });
    std::vector<TimedImage> out;
    for (int i = 0; i < count; ++i) {
      camera.push({.elapsed_ns = i * 100 * kMillisecond_ns,
                   .stamp_ns = (i * 100 - 20) * kMillisecond_ns,
                   .message = message(i)},
                  out);
    }
    camera.finish(out);
    return out;
  }
  std::span<const std::byte> message(std::int64_t number) const {
    return std::span(messages_).subspan(static_cast<std::size_t>(number), 1);
  }
  static std::vector<int> numbers(const std::vector<TimedImage>& images) {
    std::vector<int> all;
    for (const TimedImage& image : images) {
      all.push_back(std::to_integer<int>(image.message[0]));
    }
    return all;
  }
  static std::vector<std::int64_t> stamps_ms(const std::vector<TimedImage>& images) {
    std::vector<std::int64_t> all;
    for (const TimedImage& image : images) {
      all.push_back(image.stamp_ns / kMillisecond_ns);
    }
    return all;
  }

  testing::TemporaryFolder folder_;
  std::array<std::byte, 100> messages_{};
};

TEST_F(CameraFaultsTest, DropsImages) {
  EXPECT_THAT(numbers(run("- {kind: camera_drop, at_s: 0.1, for_s: 0.2}\n", 5)),
              ElementsAre(0, 3, 4));
}

TEST_F(CameraFaultsTest, FreezesTheLastImageWhileStampsGoOn) {
  const auto out = run("- {kind: camera_freeze, at_s: 0.2, for_s: 0.2}\n", 5);
  EXPECT_THAT(numbers(out), ElementsAre(0, 1, 1, 1, 4));
  EXPECT_THAT(stamps_ms(out), ElementsAre(-20, 80, 180, 280, 380));
}

TEST_F(CameraFaultsTest, FreezesTheFirstImageWhereItBeginsWithTheDrive) {
  EXPECT_THAT(numbers(run("- {kind: camera_freeze, at_s: 0, for_s: 0.3}\n", 4)),
              ElementsAre(0, 0, 0, 3));
}

TEST_F(CameraFaultsTest, BlacksOut) {
  const auto out = run("- {kind: camera_blackout, at_s: 0.1, for_s: 0.1}\n", 3);
  ASSERT_EQ(out.size(), 3U);
  EXPECT_FALSE(out[0].black);
  EXPECT_TRUE(out[1].black);
  EXPECT_FALSE(out[2].black);
}

TEST_F(CameraFaultsTest, StepsStampsOnly) {
  const auto out = run("- {kind: camera_time_step, at_s: 0.1, for_s: 0.1, step_s: -0.5}\n", 3);
  EXPECT_THAT(stamps_ms(out), ElementsAre(-20, -420, 180));
  EXPECT_EQ(out[1].elapsed_ns, 100 * kMillisecond_ns);
}

TEST_F(CameraFaultsTest, DelaysImagesAndKeepsTheirStamps) {
  const auto out = run("- {kind: camera_delay, at_s: 0.1, for_s: 0.2, delay_s: 0.25}\n", 6);
  EXPECT_THAT(numbers(out), ElementsAre(0, 3, 1, 4, 2, 5));
  EXPECT_EQ(out[2].elapsed_ns, 350 * kMillisecond_ns);
  EXPECT_EQ(out[2].stamp_ns, 80 * kMillisecond_ns);
}

TEST_F(CameraFaultsTest, ShowsAnotherPlace) {
  EXPECT_THAT(numbers(run("- {kind: camera_elsewhere, at_s: 0.1, for_s: 0.2, offset_s: 5}\n", 4)),
              ElementsAre(0, 51, 52, 3));
  EXPECT_THAT(numbers(run("- {kind: camera_elsewhere, at_s: 0.1, for_s: 0.2, offset_s: -5}\n", 4)),
              ElementsAre(0, 1, 2, 3))
      << "where there is no image the right one stays";
}

}  // namespace
}  // namespace topoloc::replay
