// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/exposure_time.hpp"

#include <gtest/gtest.h>

namespace topoloc::camera {
namespace {

constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;

TEST(ExposureTime, StampOfTheStartIsHalfAnExposureBeforeItsMiddle) {
  EXPECT_EQ(mid_exposure_ns(
                kStamp_ns,
                {.point = StampPoint::kStartOfExposure, .exposure_ns = 8'000'000, .offset_ns = 0}),
            kStamp_ns + 4'000'000);
}

TEST(ExposureTime, StampOfTheEndIsHalfAnExposureAfterItsMiddle) {
  EXPECT_EQ(
      mid_exposure_ns(kStamp_ns,
                      {.point = StampPoint::kEndOfFrame, .exposure_ns = 8'000'000, .offset_ns = 0}),
      kStamp_ns - 4'000'000);
}

TEST(ExposureTime, CalibratedOffsetIsAddedWhateverTheStampIsOf) {
  for (const StampPoint point : {StampPoint::kStartOfExposure, StampPoint::kEndOfFrame}) {
    EXPECT_EQ(
        mid_exposure_ns(kStamp_ns, {.point = point, .exposure_ns = 0, .offset_ns = -12'500'000}),
        kStamp_ns - 12'500'000);
  }
}

}  // namespace
}  // namespace topoloc::camera
