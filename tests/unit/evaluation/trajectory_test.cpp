// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/trajectory.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

class TumFile : public testing::Test {
 protected:
  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }
  std::string read_bytes() const {
    std::ostringstream text;
    text << std::ifstream(path_, std::ios::binary).rdbuf();
    return text.str();
  }
  /// Message that read_tum throws for a file of this text.
  std::string error_of(const std::string& text) {
    write(text);
    try {
      read_tum(path_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
  std::filesystem::path path_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".tum");
};

TEST(ParseSeconds, IsExactToTheNanosecond) {
  EXPECT_EQ(parse_seconds_ns("1317045935.622616123"), 1317045935622616123);
  EXPECT_EQ(parse_seconds_ns("1317045935.6"), 1317045935600000000);
  EXPECT_EQ(parse_seconds_ns("1317045935"), 1317045935000000000);
  EXPECT_EQ(parse_seconds_ns("1.317045935622616123e+09"), 1317045935622616123);
  EXPECT_EQ(parse_seconds_ns("-0.25"), -250000000);
  EXPECT_EQ(parse_seconds_ns(".5"), 500000000);
  EXPECT_EQ(parse_seconds_ns("0e30"), 0);
}

TEST(ParseSeconds, RoundsBeyondNineDecimals) {
  EXPECT_EQ(parse_seconds_ns("0.0000000014"), 1);
  EXPECT_EQ(parse_seconds_ns("0.0000000015"), 2);
  EXPECT_EQ(parse_seconds_ns("5e-10"), 1);
  EXPECT_EQ(parse_seconds_ns("5e-11"), 0);
}

TEST(ParseSeconds, RefusesWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "nan", "inf", "1,5", "1.2.3", "1e", "1e+", "0x10", "1s",
                           "10000000000", "1e11", "1e999999999"}) {
    EXPECT_EQ(parse_seconds_ns(text), std::nullopt) << text;
  }
}

TEST_F(TumFile, ReadsCommentsBlankLinesCrlfAndScientificNotation) {
  write("# t tx ty tz qx qy qz qw\r\n\r\n1.5 1e1 -2 +3.5 0 0 0 1\r\n  2.5\t1 2 3 0 0 1 0\r\n");
  const Trajectory trajectory = read_tum(path_);
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].time_ns, 1500000000);
  EXPECT_EQ(trajectory[0].T_world_imu.p, Eigen::Vector3d(10.0, -2.0, 3.5));
  EXPECT_TRUE(trajectory[1].T_world_imu.R.isApprox(so3::exp({0.0, 0.0, M_PI}), 1e-12));
}

TEST_F(TumFile, RefusesBadLinesWithFileAndLine) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  const std::string place = path_.string() + ":2: ";
  using testing::HasSubstr;
  EXPECT_THAT(error_of(good + "2 0 0 nan 0 0 0 1\n"), HasSubstr(place + "'nan'"));
  EXPECT_THAT(error_of(good + "2 0 0 inf 0 0 0 1\n"), HasSubstr(place + "'inf'"));
  EXPECT_THAT(error_of(good + "2 0 0 1e999 0 0 0 1\n"), HasSubstr(place + "'1e999'"));
  EXPECT_THAT(error_of(good + "nan 0 0 0 0 0 0 1\n"), HasSubstr(place + "time 'nan'"));
  EXPECT_THAT(error_of(good + "2 0 0 0 0 0 1\n"), HasSubstr(place + "found 7 columns"));
  EXPECT_THAT(error_of(good + "2 0 0 0 0 0 0 1 9\n"), HasSubstr(place + "found more columns"));
  EXPECT_THAT(error_of(good + "2 0 0 0 0 0 0 0\n"), HasSubstr(place + "quaternion norm"));
  EXPECT_THAT(error_of(good + "1 0 0 0 0 0 0 1\n"), HasSubstr(place + "time does not increase"));
  EXPECT_THAT(error_of(good + "0.5 0 0 0 0 0 0 1\n"), HasSubstr(place + "time does not increase"));
}

TEST_F(TumFile, RefusesEmptyAndMissingFiles) {
  EXPECT_THAT(error_of("# nothing\n"), testing::HasSubstr("no poses"));
  EXPECT_THROW(read_tum(path_.string() + ".missing"), std::runtime_error);
}

TEST_F(TumFile, WritesWhatItReadsAndTheSameBytesEachTime) {
  const Trajectory written = {
      {1317045935622616123, {so3::exp({0.1, -0.2, 3.0}), {458123.25, -0.5, 1e-3}}},
      {1317045935622616124, {so3::exp({0.0, M_PI, 0.0}), {0.0, 0.0, 0.0}}}};
  write_tum(path_, written);
  const std::string bytes = read_bytes();
  const Trajectory read = read_tum(path_);
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time_ns, written[i].time_ns);
    EXPECT_TRUE(read[i].T_world_imu.R.isApprox(written[i].T_world_imu.R, 1e-8));
    EXPECT_TRUE(read[i].T_world_imu.p.isApprox(written[i].T_world_imu.p, 1e-6));
  }
  write_tum(path_, written);
  EXPECT_EQ(read_bytes(), bytes);
}

TEST_F(TumFile, RefusesToWriteNanAndUnwritablePaths) {
  Trajectory trajectory = {{0, {}}};
  EXPECT_THROW(write_tum(path_ / "no" / "folder", trajectory), std::runtime_error);
  trajectory[0].T_world_imu.p.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(write_tum(path_, trajectory), std::runtime_error);
}

TEST(PoseAt, InterpolatesBetweenNeighbours) {
  const Trajectory trajectory = {{0, {so3::exp({0, 0, 0}), {0, 0, 0}}},
                                 {100, {so3::exp({0, 0, 0.4}), {1, 2, 3}}}};
  const auto pose = pose_at(trajectory, 25, 100);
  ASSERT_TRUE(pose.has_value());
  EXPECT_TRUE(pose->p.isApprox(Eigen::Vector3d(0.25, 0.5, 0.75), 1e-12));
  EXPECT_TRUE(pose->R.isApprox(so3::exp({0, 0, 0.1}), 1e-12));
}

TEST(PoseAt, NeverExtrapolatesNorBridgesGaps) {
  const Trajectory trajectory = {{0, {}}, {100, {}}, {300, {}}};
  EXPECT_FALSE(pose_at({}, 0, 100));
  EXPECT_FALSE(pose_at(trajectory, -1, 100));
  EXPECT_FALSE(pose_at(trajectory, 301, 100));
  EXPECT_FALSE(pose_at(trajectory, 200, 100));
  EXPECT_TRUE(pose_at(trajectory, 50, 100));
  EXPECT_TRUE(pose_at(trajectory, 300, 0));
  EXPECT_TRUE(pose_at(trajectory, 0, 0));
}

TEST(BesideTrajectory, TakesOffNothingButTum) {
  EXPECT_EQ(beside("out/est.tum", ".states.csv"), "out/est.states.csv");
  EXPECT_EQ(beside("est_0.5", ".states.csv"), "est_0.5.states.csv");
  EXPECT_EQ(beside("est_0.8", ".states.csv"), "est_0.8.states.csv");
  EXPECT_EQ(beside("est_0.5.tum", ".updates.csv"), "est_0.5.updates.csv");
}

}  // namespace
}  // namespace topoloc::evaluation
