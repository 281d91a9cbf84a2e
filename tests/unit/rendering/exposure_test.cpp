// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/exposure.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::rendering {
namespace {

CameraSpec at_rate(double rate_hz) {
  CameraSpec spec;
  spec.rate_hz = rate_hz;
  return spec;
}

double total_s(const ExposureControl& control) { return control.exposure_s() * control.gain(); }

/// Level of an image whose light is right with an exposure (times gain) of `right_s`.
double level(const CameraSpec& spec, double exposure_s, double right_s) {
  return std::min(1.0, spec.target_level * std::pow(exposure_s / right_s, 1.0 / 2.2));
}

/// Time until the images are exposed well where the light changes from what needs 8 ms to what
/// needs `right_s`.
double adapting_s(double rate_hz, double right_s) {
  const CameraSpec spec = at_rate(rate_hz);
  ExposureControl control(spec);
  control.settle([&](double exposure_s) { return level(spec, exposure_s, 0.008); });
  int images = 0;
  while (std::abs(level(spec, total_s(control), right_s) - spec.target_level) > 0.05) {
    control.observe(level(spec, total_s(control), right_s));
    ++images;
  }
  return images / rate_hz;
}

TEST(ExposureControl, GoesAThirdOfTheWayInATenthOfASecond) {
  const CameraSpec spec = at_rate(10.0);
  ExposureControl control(spec);
  control.settle([&](double exposure_s) { return level(spec, exposure_s, 0.004); });
  const double before_s = total_s(control);
  control.observe(0.6);
  EXPECT_EQ(total_s(control), before_s * std::pow(spec.target_level / 0.6, 2.2 * 0.35));
}

TEST(ExposureControl, TakesAsLongWithFewImagesASecondAsWithMany) {
  for (const double right_s : {0.0004, 0.1}) {  // the end of a tunnel, its begin
    const double usual_s = adapting_s(10.0, right_s);
    EXPECT_GT(usual_s, 0.3);
    for (const double rate_hz : {4.0, 5.0, 20.0, 60.0}) {
      EXPECT_NEAR(adapting_s(rate_hz, right_s), usual_s, std::max(0.1, 1.0 / rate_hz) + 1e-9)
          << rate_hz << " Hz, " << right_s;
    }
  }
}

TEST(ExposureControl, DoesNotSwingWithOneImageInSeconds) {
  const CameraSpec spec = at_rate(0.1);
  ExposureControl control(spec);
  control.settle([&](double exposure_s) { return level(spec, exposure_s, 0.008); });
  control.observe(level(spec, total_s(control), 0.004));
  EXPECT_NEAR(total_s(control), 0.004, 1e-6);
}

}  // namespace
}  // namespace topoloc::rendering
