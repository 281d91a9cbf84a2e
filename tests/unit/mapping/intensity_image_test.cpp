// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/intensity_image.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

using ::testing::ElementsAre;

RenderedView view_of(std::vector<float> intensity) {
  RenderedView view;
  view.point.assign(intensity.size(), 0);
  view.intensity = std::move(intensity);
  return view;
}

TEST(IntensityImage, BrightestBut2PercentBecome250) {
  std::vector<float> intensity(99, 0.5F);
  intensity[0] = 1e6F;  // a retro-reflector
  intensity[1] = 0.25F;
  const auto image = intensity_image(view_of(intensity));
  EXPECT_EQ(image[0], 255);
  EXPECT_EQ(image[1], 125);
  EXPECT_EQ(image[2], 250);
}

TEST(IntensityImage, OnlyHolesAreZero) {
  RenderedView view = view_of({0.0F, NAN, -3.0F, 0.0F, 2.0F, 2.0F});
  view.point[3] = RenderedView::kHole;
  EXPECT_THAT(intensity_image(view), ElementsAre(1, 1, 1, 0, 250, 250));
}

TEST(IntensityImage, TakesAViewWithoutBrightPoints) {
  EXPECT_THAT(intensity_image(view_of({0.0F, 0.0F})), ElementsAre(1, 1));
  RenderedView view = view_of({0.0F});
  view.point[0] = RenderedView::kHole;
  EXPECT_THAT(intensity_image(view), ElementsAre(0));
}

}  // namespace
}  // namespace topoloc::mapping
