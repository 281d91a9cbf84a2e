// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/drive.hpp"

#include "topoloc/transport/lcm_log.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <topoloc/image_t.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::drive {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidth_px = 64;
constexpr int kHeight_px = 32;
constexpr std::int64_t kStart_us = 1'700'000'000'000'000;

image_t grey_image(std::int64_t time_us, std::uint8_t level) {
  image_t image{};
  image.utime = time_us;
  image.width = kWidth_px;
  image.height = kHeight_px;
  image.row_stride = kWidth_px + 8;  // padded rows
  image.pixelformat = transport::kPixelFormatGray;
  image.data.assign(static_cast<std::size_t>(image.row_stride * kHeight_px), level);
  image.size = static_cast<std::int32_t>(image.data.size());
  return image;
}

image_t jpeg_image(std::int64_t time_us, std::uint8_t level) {
  return testing::jpeg_image(time_us, cv::Mat(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(level)));
}

class DriveTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // Acceleration z 9.8 (49000 counts), rate z 0.1 (5000), both wheels 1.5 (750), reverse.
    folder_.write("can.log",
                  "(1700000000.000000) can0 100#000000000068BF00\n"
                  "(1700000000.000000) can0 101#0000000000881300\n"
                  "(1700000000.000000) can0 103#02\n"
                  "(1700000000.000000) can0 102#EE02000000000000\n");
  }

  /// Appends samples 10 ms apart to can.log: IMU and speed frames, the first at this time.
  void append_samples(double first_s, int count) const {
    std::ofstream log(dir_ / "can.log", std::ios::app);
    for (int i = 0; i < count; ++i) {
      char lines[256];
      const double time_s = first_s + 0.01 * i;
      std::snprintf(lines, sizeof lines,  // the last byte holds the counter
                    "(%.6f) can0 100#000000000068BF%X0\n"
                    "(%.6f) can0 101#00000000008813%X0\n"
                    "(%.6f) can0 102#EE02000000000000\n",
                    time_s, i % 16, time_s, i % 16, time_s);
      log << lines;
    }
  }
  template <typename Function>
  [[nodiscard]] static std::string complaint(const Function& function) {
    try {
      function();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    ADD_FAILURE() << "no complaint";
    return "";
  }

  testing::TemporaryFolder temporary_;
  testing::DriveFolder folder_{temporary_ / "drive",
                               {.width_px = kWidth_px,
                                .height_px = kHeight_px,
                                .fx_px = 50.0,
                                .fy_px = 50.0,
                                .cx_px = 32.0,
                                .cy_px = 16.0},
                               0.25};
  std::filesystem::path dir_ = folder_.dir();
};

TEST_F(DriveTest, ReverseValueThatDoesNotFitIsNamedWithFileLineAndKey) {
  std::ifstream file(dir_ / "vehicle.yaml");
  std::string text(std::istreambuf_iterator<char>(file), {});
  text.replace(text.find("[REVERSE]"), 9, "[\"6\"]");
  folder_.write("vehicle.yaml", text);
  EXPECT_THAT(complaint([this] { load_drive(dir_); }),
              HasSubstr("vehicle.yaml:10: can.direction.reverse_values: reverse value '6' of "
                        "signal 'TRAVEL_DIRECTION.DIRECTION' does not fit its 2 bits"));
}

TEST_F(DriveTest, TimesIncreaseWhereTheClockWasSetBack) {
  append_samples(1'700'000'001.0, 20);
  append_samples(1'700'000'001.1, 30);  // set back by 0.1 s
  const Drive drive = load_drive(dir_);
  const auto later = [](const auto& a, const auto& b) { return a.time_ns >= b.time_ns; };
  EXPECT_EQ(std::adjacent_find(drive.imu.begin(), drive.imu.end(), later), drive.imu.end());
  EXPECT_EQ(std::adjacent_find(drive.speed.begin(), drive.speed.end(), later), drive.speed.end());
  EXPECT_EQ(drive.imu.back().time_ns, 1'700'000'001'390'000'000);
  EXPECT_EQ(drive.speed.back().time_ns, 1'700'000'001'390'000'000);
  EXPECT_GT(drive.rejected.at("clock set back"), 0U);
}

TEST_F(DriveTest, DecodesCanLogWithTheShippedDbc) {
  const Drive drive = load_drive(dir_);
  ASSERT_EQ(drive.imu.size(), 1U);
  EXPECT_EQ(drive.imu[0].time_ns, kStart_us * 1000);
  EXPECT_NEAR(drive.imu[0].specific_force_mps2.z(), 9.8, 1e-9);
  EXPECT_NEAR(drive.imu[0].angular_rate_radps.z(), 0.1, 1e-9);
  ASSERT_EQ(drive.speed.size(), 1U);
  EXPECT_NEAR(drive.speed[0].speed_mps, -0.75, 1e-9);  // mean of 1.5 and 0, backwards
  EXPECT_EQ(drive.can_frames, 4U);
  EXPECT_TRUE(drive.rejected.empty());
  EXPECT_FALSE(drive.ground_truth.has_value());
}

TEST_F(DriveTest, CountsWhatItCannotUse) {
  std::ofstream(dir_ / "can.log", std::ios::app) << "garbage\n"
                                                 << "(1700000000.010000) can0 102#EE02\n";
  const Drive drive = load_drive(dir_);
  EXPECT_EQ(drive.rejected.at("malformed line"), 1U);
  EXPECT_EQ(drive.rejected.size(), 2U);
  EXPECT_THAT(drive.first_malformed_line, HasSubstr("can.log:5"));
}

TEST_F(DriveTest, NamesMissingFiles) {
  EXPECT_THAT(complaint([&] { load_drive(dir_ / "nowhere"); }), HasSubstr("no such drive folder"));
  std::filesystem::remove(dir_ / "can.log");
  EXPECT_THAT(complaint([&] { load_drive(dir_); }), HasSubstr("can.log: no such file"));
}

TEST_F(DriveTest, LogWithoutInertialSamplesIsAnError) {
  folder_.write("can.log", "(1700000000.000000) can0 7FF#00\n");
  EXPECT_THAT(complaint([&] { load_drive(dir_); }), HasSubstr("no IMU sample in 1 frames"));
}

TEST_F(DriveTest, ReadsGroundTruthAndItsErrors) {
  folder_.write("ground_truth.tum", "1700000000.000000000 1 2 3 0 0 0 1\n");
  const Drive drive = load_drive(dir_);
  ASSERT_TRUE(drive.ground_truth.has_value());
  EXPECT_EQ(drive.ground_truth->at(0).T_world_imu.p, Eigen::Vector3d(1.0, 2.0, 3.0));
  folder_.write("ground_truth.tum", "1700000000 1 2 nan 0 0 0 1\n");
  EXPECT_THAT(complaint([&] { load_drive(dir_); }), HasSubstr("ground_truth.tum:1"));
}

TEST_F(DriveTest, GivesGreyFramesOnTheImuClock) {
  folder_.write_images(
      std::vector{grey_image(kStart_us, 10), jpeg_image(kStart_us + 100'000, 200)});
  FrameLog frames = open_frames(load_drive(dir_));
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames.time_ns(0), kStart_us * 1000 + 250'000'000);  // timeshift_cam_imu
  for (std::size_t i = 0; i < 2; ++i) {
    const cv::Mat grey = frames.grey(i);
    ASSERT_EQ(grey.size(), cv::Size(kWidth_px, kHeight_px));
    EXPECT_EQ(grey.type(), CV_8UC1);
    EXPECT_NEAR(grey.at<std::uint8_t>(31, 63), i == 0 ? 10 : 200, 1);
  }
  EXPECT_TRUE(frames.first_error().empty());
}

TEST_F(DriveTest, RejectsBadFramesAndCountsThem) {
  image_t small = grey_image(kStart_us + 1, 1);
  small.width = 32;
  image_t unknown = grey_image(kStart_us + 2, 1);
  unknown.pixelformat = 1;
  image_t broken = jpeg_image(kStart_us + 3, 1);
  broken.data.assign(broken.data.size(), 0);
  folder_.write_images(std::vector{grey_image(kStart_us, 1), small, unknown,
                                   grey_image(kStart_us, 2), broken, grey_image(kStart_us + 4, 3)});
  FrameLog frames = open_frames(load_drive(dir_));
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames.rejected(FrameReject::kWrongSize), 1U);
  EXPECT_EQ(frames.rejected(FrameReject::kBadMessage), 1U);
  EXPECT_EQ(frames.rejected(FrameReject::kNonMonotonicTime), 1U);
  EXPECT_EQ(frames.rejected(FrameReject::kUndecodable), 0U);  // headers only so far
  EXPECT_THAT(frames.first_error(), AllOf(HasSubstr("event 1"), HasSubstr("32x32")));
  EXPECT_TRUE(frames.grey(1).empty());
  EXPECT_EQ(frames.rejected(FrameReject::kUndecodable), 1U);
  EXPECT_FALSE(frames.grey(2).empty());
  EXPECT_EQ(frames.rejected().size(), 4U);
  EXPECT_EQ(frames.rejected().at("undecodable image"), 1U);
}

TEST_F(DriveTest, LogWithoutUsableImageNamesTheChannelsItHas) {
  {
    transport::LcmLogWriter log(dir_ / "camera.lcm");
    log.write(kStart_us, "OTHER", std::vector<std::byte>(4));
    log.close();
  }
  const Drive drive = load_drive(dir_);
  EXPECT_THAT(complaint([&] { open_frames(drive); }),
              AllOf(HasSubstr("channel CAMERA"), HasSubstr("OTHER")));
  std::filesystem::remove(dir_ / "camera.lcm");
  EXPECT_THAT(complaint([&] { open_frames(drive); }), HasSubstr("camera.lcm: no such file"));
}

TEST_F(DriveTest, ReadsTheCameraMask) {
  config::CameraConfig camera = load_drive(dir_).vehicle.camera;
  EXPECT_TRUE(read_mask(camera).empty());
  camera.mask = dir_ / "mask.png";
  cv::imwrite(camera.mask.string(), cv::Mat(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(read_mask(camera).size(), cv::Size(kWidth_px, kHeight_px));
}

TEST_F(DriveTest, MaskThatDoesNotFitNamesItsFile) {
  config::CameraConfig camera = load_drive(dir_).vehicle.camera;
  camera.mask = dir_ / "mask.png";
  EXPECT_THAT(complaint([&] { read_mask(camera); }),
              AllOf(HasSubstr("mask.png"), HasSubstr("cannot be read")));
  cv::imwrite(camera.mask.string(), cv::Mat(10, 20, CV_8UC1, cv::Scalar(255)));
  EXPECT_THAT(complaint([&] { read_mask(camera); }),
              AllOf(HasSubstr("mask.png"), HasSubstr("20x10"), HasSubstr("64x32")));
}

TEST_F(DriveTest, ReadsBackWhatATestWroteAsCanLog) {
  folder_.write_can_log(std::vector<testing::CanRow>{
      {.time_us = kStart_us, .speed_mps = -1.5},
      {.time_us = kStart_us + 10'000, .specific_force_mps2 = {-1.0, 2.0, 9.8}}});
  const Drive drive = load_drive(dir_);
  EXPECT_TRUE(drive.rejected.empty());
  ASSERT_EQ(drive.imu.size(), 2U);
  EXPECT_TRUE(drive.imu[1].specific_force_mps2.isApprox(Eigen::Vector3d(-1.0, 2.0, 9.8), 1e-9));
  ASSERT_EQ(drive.speed.size(), 1U);
  EXPECT_NEAR(drive.speed[0].speed_mps, -1.5, 1e-9);
}

/// A folder made by topoloc-import from the shared drive; without Python or data the test skips.
TEST_F(DriveTest, LoadsAnImportedDrive) {
  const char* data = std::getenv("TOPOLOC_DATA");
  const std::filesystem::path source =
      std::filesystem::path(data != nullptr ? data : TOPOLOC_SOURCE_DIR "/../shared/data") /
      "kitti_0039";
  const std::string tool = TOPOLOC_SOURCE_DIR "/tools/topoloc-import";
  if (!std::filesystem::is_directory(source)) {
    GTEST_SKIP() << "no " << source;
  }
  if (std::system((tool + " --help >/dev/null 2>&1").c_str()) != 0) {
    GTEST_SKIP() << tool << " has no Python";
  }
  const std::filesystem::path out = dir_ / "imported";
  ASSERT_EQ(std::system((tool + " kitti-0039 '" + source.string() + "' --out '" + out.string() +
                         "' 2>/dev/null")
                            .c_str()),
            0);
  const Drive drive = load_drive(out);
  EXPECT_EQ(drive.imu.size(), 1002U);
  EXPECT_EQ(drive.speed.size(), 1002U);
  EXPECT_TRUE(drive.rejected.empty());
  ASSERT_TRUE(drive.ground_truth.has_value());
  FrameLog frames = open_frames(drive);
  ASSERT_EQ(frames.size(), 400U);
  EXPECT_EQ(frames.grey(399).size(), cv::Size(1392, 512));

  std::ifstream csv(source / "imu.csv");
  std::string line;
  std::getline(csv, line);  // header
  for (const estimation::ImuSample& sample : drive.imu) {
    ASSERT_TRUE(std::getline(csv, line));
    std::int64_t time_ns = 0;
    Eigen::Vector3d f;
    Eigen::Vector3d w;
    ASSERT_EQ(std::sscanf(line.c_str(), "%ld,%lf,%lf,%lf,%lf,%lf,%lf", &time_ns, &f.x(), &f.y(),
                          &f.z(), &w.x(), &w.y(), &w.z()),
              7);
    EXPECT_LE(std::abs(sample.time_ns - time_ns), 500);
    EXPECT_LE((sample.specific_force_mps2 - f).cwiseAbs().maxCoeff(), 1.01e-4);
    // The importer moves the rates, which lag: tests/python/test_import.py compares them.
    EXPECT_TRUE(sample.angular_rate_radps.allFinite());
  }
}

}  // namespace
}  // namespace topoloc::drive
