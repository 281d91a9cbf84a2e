// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/stamps_file.hpp"

#include "topoloc/camera/image_times.hpp"

#include "support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::camera {
namespace {

using ::testing::HasSubstr;
using topoloc::testing::TemporaryFolder;

std::vector<ImageStamp> parsed(std::string_view text) {
  const TemporaryFolder folder;
  return read_stamps(folder.with("times.txt", text));
}

std::string error_of(std::string_view text) {
  try {
    (void)parsed(text);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "none";
}

TEST(StampsFile, SecondsHaveADecimalPointAndKeepTheirNanoseconds) {
  const auto stamps = parsed("1317045935.123456789\n1317045935.2\r\n\n1317045936.\n");
  ASSERT_EQ(stamps.size(), 3U);
  EXPECT_EQ(stamps[0].time_ns, 1'317'045'935'123'456'789);
  EXPECT_EQ(stamps[1].time_ns, 1'317'045'935'200'000'000);
  EXPECT_EQ(stamps[2].time_ns, 1'317'045'936'000'000'000);
}

TEST(StampsFile, ListsOfTumAndEurocAreRead) {
  const auto tum = parsed("# time file\n1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b.png");
  ASSERT_EQ(tum.size(), 2U);
  EXPECT_EQ(tum[0].time_ns, 1'305'031'102'175'304'000);
  EXPECT_EQ(tum[1].name, "rgb/b.png");
  const auto euroc =
      parsed("#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png");
  ASSERT_EQ(euroc.size(), 1U);
  EXPECT_EQ(euroc[0].time_ns, 1'403'636'579'763'555'584);
  EXPECT_EQ(euroc[0].name, "1403636579763555584.png");
}

TEST(StampsFile, ErrorsNameFileAndLine) {
  EXPECT_THAT(error_of("1.0\nx\n"), HasSubstr("times.txt:2: expected a time"));
  EXPECT_THAT(error_of("1.0\n2.0x\n"), HasSubstr("found '2.0x'"));
  EXPECT_THAT(error_of("-1.0\n"), HasSubstr("times.txt:1: expected a time"));
  EXPECT_THAT(error_of("99999999999999.0\n"), HasSubstr("expected a time"));
  EXPECT_THAT(error_of("1.0\n1.0\n"), HasSubstr("times.txt:2: the time is not later"));
  EXPECT_THAT(error_of("# c\n1.0 a\n2.0\n"), HasSubstr("times.txt:3: names of images"));
  EXPECT_THAT(error_of("# nothing\n"), HasSubstr("no time stamps"));
}

TEST(StampsFile, WholeSecondsAreNotMistakenForNanoseconds) {
  EXPECT_THAT(error_of("1305031102\n1305031103\n"), HasSubstr("whole numbers are nanoseconds"));
}

TEST(ImageTimes, FixedRateDoesNotAddUpItsRounding) {
  const ImageTimes times(30.0);
  std::int64_t elapsed_ns = 0;
  ASSERT_TRUE(times.elapsed_ns(3'000'000, elapsed_ns));
  EXPECT_EQ(elapsed_ns, 100'000'000'000'000);
  EXPECT_EQ(times.lap_ns(30), 1'000'000'000);
}

TEST(ImageTimes, NextLapBeginsOneMeanPeriodAfterTheLastStamp) {
  const ImageTimes times({{5'000'000'000, ""}, {5'100'000'000, ""}, {5'400'000'000, ""}});
  std::int64_t elapsed_ns = 0;
  ASSERT_TRUE(times.elapsed_ns(2, elapsed_ns));
  EXPECT_EQ(elapsed_ns, 400'000'000);
  EXPECT_FALSE(times.elapsed_ns(3, elapsed_ns));
  EXPECT_EQ(times.lap_ns(3), 600'000'000);
  EXPECT_EQ(times.first_ns(), 5'000'000'000);
}

TEST(ImageTimes, RateIsPositive) { EXPECT_THROW(ImageTimes(0.0), std::invalid_argument); }

}  // namespace
}  // namespace topoloc::camera
