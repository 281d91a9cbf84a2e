// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"
#include "topoloc/map/types.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::map {
namespace {

TEST(FeatureRecord, CodesAreMonotoneAndStable) {
  for (int c = 0; c < 256; ++c) {
    const auto code = static_cast<std::uint8_t>(c);
    EXPECT_EQ(FeatureRecord::encode_score(FeatureRecord::decode_score(code)), code);
    EXPECT_EQ(FeatureRecord::encode_depth_std(FeatureRecord::decode_depth_std_m(code)), code);
    if (c > 0) {
      const auto below = static_cast<std::uint8_t>(c - 1);
      EXPECT_LT(FeatureRecord::decode_score(below), FeatureRecord::decode_score(code));
      EXPECT_LT(FeatureRecord::decode_depth_std_m(below), FeatureRecord::decode_depth_std_m(code));
    }
  }
}

TEST(FeatureRecord, ScoreErrorIsBelowFourThousandths) {
  for (int i = 0; i <= 1000; ++i) {
    const float score = static_cast<float>(i) / 1000.0F;
    EXPECT_NEAR(FeatureRecord::decode_score(FeatureRecord::encode_score(score)), score, 0.004F);
  }
  EXPECT_EQ(FeatureRecord::decode_score(FeatureRecord::encode_score(7.0F)), 1.0F);
  EXPECT_EQ(FeatureRecord::decode_score(FeatureRecord::encode_score(-7.0F)), 0.0F);
}

TEST(FeatureRecord, DepthDeviationErrorIsBelow2Point3PerCent) {
  for (double std_m = 0.001; std_m < 60.0; std_m *= 1.001) {
    const auto value = static_cast<float>(std_m);
    const float back = FeatureRecord::decode_depth_std_m(FeatureRecord::encode_depth_std(value));
    ASSERT_NEAR(back / value, 1.0F, 0.023F) << std_m;
  }
  EXPECT_EQ(FeatureRecord::encode_depth_std(0.0F), 0);
  EXPECT_EQ(FeatureRecord::encode_depth_std(1e-6F), 1);
  EXPECT_EQ(FeatureRecord::encode_depth_std(1e6F), 255);
  // The documented formula, not only its own inverse.
  EXPECT_NEAR(FeatureRecord::decode_depth_std_m(1), 0.001F, 1e-9F);
  EXPECT_NEAR(FeatureRecord::decode_depth_std_m(161), 1.024F, 1e-6F);
  EXPECT_NEAR(FeatureRecord::decode_depth_std_m(100), 1e-3 * std::exp2(99.0 / 16.0), 1e-6);
}

TEST(FeatureRecord, KeepsPixelsToA64thOfAPixel) {
  const PinholeCamera camera{2048, 2048, 1000, 1000, 1023.5, 1023.5};
  Feature feature;
  for (float x = 0.0F; x <= 2047.0F; x += 0.37F) {
    feature.pixel_px = {x, 2047.0F - x};
    const FeatureRecord record = FeatureRecord::from(feature);
    ASSERT_LE((record.pixel_px() - feature.pixel_px).cwiseAbs().maxCoeff(), 1.0F / 64.0F);
    ASSERT_TRUE(camera.contains(record.pixel_px().cast<double>()));
  }
}

TEST(FeatureRecord, PointLiesOnTheRayAtItsDepth) {
  const PinholeCamera camera{640, 384, 450.0, 460.0, 319.5, 191.5};
  Feature feature;
  feature.pixel_px = {100.25F, 300.5F};
  feature.depth_m = 12.5F;
  const Eigen::Vector3d point = FeatureRecord::from(feature).point_cam(camera);
  EXPECT_DOUBLE_EQ(point.z(), 12.5);
  EXPECT_TRUE(camera.project(point).isApprox(Eigen::Vector2d(100.25, 300.5), 1e-12));
}

TEST(Descriptors, KeepTheirDirection) {
  std::array<float, 64> values{};
  float norm = 0.0F;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = std::sin(1.7F * static_cast<float>(i * i));
    norm += values[i] * values[i];
  }
  std::array<std::int8_t, 64> codes{};
  std::array<float, 64> back{};
  for (float& x : values) {
    x /= std::sqrt(norm);
  }
  encode_descriptors(values, codes);
  decode_descriptors(codes, back);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(back[i], values[i], 0.5F / 127.0F + 1e-6F);
  }
  const std::array<float, 2> wild{2.0F, -2.0F};
  encode_descriptors(wild, std::span(codes).first(2));
  EXPECT_EQ(codes[0], 127);
  EXPECT_EQ(codes[1], -127);
}

std::vector<float> round_trip(const std::vector<float>& depth_m, int width_px, int height_px) {
  int w = 0;
  int h = 0;
  std::vector<float> back = decode_depth(encode_depth(depth_m, width_px, height_px), w, h);
  EXPECT_EQ(w, width_px);
  EXPECT_EQ(h, height_px);
  return back;
}

TEST(DepthCodec, KeepsDepthToTwoMillimetres) {
  std::vector<float> depth_m;
  for (int i = 0; i < 64 * 32; ++i) {
    depth_m.push_back(0.01F + 0.12F * static_cast<float>(i));
  }
  const std::vector<float> back = round_trip(depth_m, 64, 32);
  ASSERT_EQ(back.size(), depth_m.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_NEAR(back[i], depth_m[i], 0.5F / 256.0F + 1e-5F);
  }
}

TEST(DepthCodec, WhatIsNotADepthBecomesNoDepth) {
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<float> back =
      round_trip({0.0F, -1.0F, NAN, infinity, -infinity, 256.0F, 1e30F, 255.99F}, 4, 2);
  EXPECT_EQ(back, (std::vector<float>{0, 0, 0, 0, 0, 0, 0, 65533.0F / 256.0F}));
}

TEST(DepthCodec, AVeryNearPointDoesNotTurnIntoNoDepth) {
  EXPECT_GT(round_trip({0.001F}, 1, 1)[0], 0.0F);
}

TEST(DepthCodec, RefusesSizesThatDisagree) {
  const std::vector<float> depth_m(6, 1.0F);
  EXPECT_THROW(encode_depth(depth_m, 2, 2), std::invalid_argument);
  EXPECT_THROW(encode_depth(depth_m, -2, -3), std::invalid_argument);
  EXPECT_THROW(encode_depth({}, 0, 0), std::invalid_argument);
}

TEST(IntensityCodec, KeepsEveryValue) {
  std::vector<std::uint8_t> intensity(64 * 32);
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    intensity[i] = static_cast<std::uint8_t>(i % 251);
  }
  int w = 0;
  int h = 0;
  EXPECT_EQ(decode_intensity(encode_intensity(intensity, 64, 32), w, h), intensity);
  EXPECT_EQ(w, 64);
  EXPECT_EQ(h, 32);
}

TEST(IntensityCodec, RefusesSizesThatDisagreeAndOtherImages) {
  const std::vector<std::uint8_t> intensity(6, 1);
  EXPECT_THROW(encode_intensity(intensity, 2, 2), std::invalid_argument);
  int w = 0;
  int h = 0;
  const std::vector<std::byte> depth = encode_depth(std::vector<float>(6, 1.0F), 3, 2);
  EXPECT_THROW(decode_intensity(depth, w, h), MapError);
}

TEST(DepthCodec, RefusesDamagedData) {
  std::vector<float> depth_m(640);
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    depth_m[i] = static_cast<float>(i % 37);
  }
  const std::vector<std::byte> good = encode_depth(depth_m, 32, 20);
  int w = 0;
  int h = 0;
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_THROW(decode_depth(std::span(good).first(size), w, h), MapError) << size;
  }
  // A size that is not the data's must not be believed: no allocation of 16 GB, no overrun.
  for (const std::size_t byte : {4U, 5U, 6U, 7U, 8U, 11U}) {
    std::vector<std::byte> bad = good;
    bad[byte] ^= std::byte{0x7f};
    EXPECT_THROW(decode_depth(bad, w, h), MapError) << byte;
  }
}

}  // namespace
}  // namespace topoloc::map
