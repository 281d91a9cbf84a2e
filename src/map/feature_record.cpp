// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/feature_record.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace topoloc::map {
namespace {

/// 1 mm * 2^((c - 1) / 16) by multiplication, so that every machine has the same table.
constexpr std::array<float, 256> make_depth_std_table() {
  constexpr double kSixteenthRootOf2 = 1.0442737824274138;
  std::array<float, 256> table{};
  double octave = 1e-3;
  for (std::size_t i = 0; i < 255; ++i) {
    double value = octave;
    for (std::size_t step = 0; step < i % 16; ++step) {
      value *= kSixteenthRootOf2;
    }
    table[i + 1] = static_cast<float>(value);
    if (i % 16 == 15) {
      octave *= 2.0;
    }
  }
  return table;
}
constexpr std::array<float, 256> kDepthStd_m = make_depth_std_table();

}  // namespace

FeatureRecord FeatureRecord::from(const Feature& feature) {
  FeatureRecord record;
  record.u = static_cast<std::uint16_t>(std::lround(feature.pixel_px.x() / kPixelStep_px));
  record.v = static_cast<std::uint16_t>(std::lround(feature.pixel_px.y() / kPixelStep_px));
  record.depth_m = feature.depth_m;
  record.score_code = encode_score(feature.score);
  record.depth_std_code = encode_depth_std(feature.depth_std_m);
  return record;
}

std::uint8_t FeatureRecord::encode_score(float score) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::sqrt(std::clamp(score, 0.0F, 1.0F))));
}

float FeatureRecord::decode_score(std::uint8_t code) {
  const float root = static_cast<float>(code) / 255.0F;
  return root * root;
}

std::uint8_t FeatureRecord::encode_depth_std(float depth_std_m) {
  if (!(depth_std_m > 0.0F)) {
    return 0;
  }
  const auto above = std::lower_bound(kDepthStd_m.begin() + 1, kDepthStd_m.end(), depth_std_m);
  auto code = above - kDepthStd_m.begin();
  if (above == kDepthStd_m.end()) {
    code = 255;
  } else if (code > 1 && depth_std_m * depth_std_m < *above * *(above - 1)) {
    --code;  // nearer to the one below, by ratio
  }
  return static_cast<std::uint8_t>(code);
}

float FeatureRecord::decode_depth_std_m(std::uint8_t code) { return kDepthStd_m[code]; }

void encode_descriptors(std::span<const float> values, std::span<std::int8_t> codes) {
  assert(values.size() == codes.size());
  std::transform(values.begin(), values.end(), codes.begin(), [](float x) {
    return static_cast<std::int8_t>(std::lround(127.0F * std::clamp(x, -1.0F, 1.0F)));
  });
}

void decode_descriptors(std::span<const std::int8_t> codes, std::span<float> values) {
  assert(values.size() == codes.size());
  std::transform(codes.begin(), codes.end(), values.begin(),
                 [](std::int8_t code) { return static_cast<float>(code) / 127.0F; });
}

}  // namespace topoloc::map
