// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <array>
#include <cmath>
#include <cstdint>

namespace topoloc::world::patterns {

using namespace noise;

namespace {

enum Stroke : std::uint32_t {
  kLeft = 1U << 0U,
  kRight = 1U << 1U,
  kTop = 1U << 2U,
  kBottom = 1U << 3U,
  kMiddle = 1U << 4U,
  kRising = 1U << 5U,
  kFalling = 1U << 6U,
  kStem = 1U << 7U,
};

// Letters that straight strokes over the whole height and width can write.
constexpr std::array<std::uint32_t, 16> kLetters = {
    kLeft | kRight | kTop | kMiddle,            // A
    kLeft | kRight | kTop | kMiddle | kBottom,  // B
    kLeft | kTop | kBottom,                     // C
    kLeft | kTop | kMiddle | kBottom,           // E
    kLeft | kTop | kMiddle,                     // F
    kLeft | kRight | kMiddle,                   // H
    kStem,                                      // I
    kRight | kBottom,                           // J
    kLeft | kBottom,                            // L
    kLeft | kRight | kFalling,                  // N
    kLeft | kRight | kTop | kBottom,            // O
    kStem | kTop,                               // T
    kLeft | kRight | kBottom,                   // U
    kRising | kFalling,                         // X
    kTop | kRising | kBottom,                   // Z
    kTop | kRising,                             // 7
};

}  // namespace

// x: from left to right, y: upwards, in heights of the letter.
float letter(float x, float y, float footprint, std::uint32_t seed) {
  constexpr float kWidth = 0.62F;
  constexpr float kStroke = 0.13F;
  if (x < -0.1F || x > kWidth + 0.1F || y < -0.1F || y > 1.1F) {
    return 0.0F;
  }
  const std::uint32_t strokes = kLetters[(hash(seed, 3U, 0x1E77U) >> 8U) % kLetters.size()];
  const float high = band(y, 0.0F, 1.0F, footprint);
  const float wide = band(x, 0.0F, kWidth, footprint);
  float ink = 0.0F;
  const auto add = [&](Stroke stroke, float share) {
    if ((strokes & stroke) != 0U) {
      ink = std::max(ink, share);
    }
  };
  add(kLeft, high * band(x, 0.0F, kStroke, footprint));
  add(kRight, high * band(x, kWidth - kStroke, kWidth, footprint));
  add(kTop, wide * band(y, 1.0F - kStroke, 1.0F, footprint));
  add(kBottom, wide * band(y, 0.0F, kStroke, footprint));
  add(kMiddle, wide * band(y - 0.5F, -0.5F * kStroke, 0.5F * kStroke, footprint));
  add(kRising, high * wide * band(x - kWidth * y, -0.6F * kStroke, 0.6F * kStroke, footprint));
  add(kFalling,
      high * wide * band(x - kWidth * (1.0F - y), -0.6F * kStroke, 0.6F * kStroke, footprint));
  add(kStem, high * band(x - 0.5F * kWidth, -0.5F * kStroke, 0.5F * kStroke, footprint));
  return ink;
}

float lettering(float x, float y, float footprint, std::uint32_t seed, int letters) {
  constexpr float kPitch = 0.8F;
  if (y < -0.2F || y > 1.2F || x < -0.1F || x > kPitch * static_cast<float>(letters)) {
    return 0.0F;
  }
  const float place = whole(x / kPitch);
  const std::uint32_t key = hash(cell(x / kPitch), 5U, seed);
  const float inked = letter(x - place * kPitch, y, footprint, key);
  constexpr float kMeanInk = 0.3F;
  // Words are apart.
  return unit(again(key)) < 0.14F ? 0.0F : mix(kMeanInk, inked, fade(0.3F, footprint));
}

namespace {

float text_lines(const Spot& s, float margin_m, float height_m, float gap_m, int lines) {
  const float v = s.v - margin_m;
  const int line = static_cast<int>(whole(v / (height_m + gap_m)));
  if (line < 0 || line >= lines) {
    return 0.0F;
  }
  const float y = (v - static_cast<float>(line) * (height_m + gap_m)) / height_m;
  const std::uint32_t key = hash(static_cast<std::uint32_t>(line), 9U, s.seed + s.instance);
  const float room = (s.p[0] - 2.0F * margin_m) / height_m;
  const int letters = std::max(1, static_cast<int>(room / 0.8F * (0.55F + 0.45F * unit(key))));
  return lettering((s.u - margin_m) / height_m, y, s.footprint / height_m, key, letters);
}

Appearance painted(float face, float ink_tone, float ink, float retro, float ink_retro) {
  const float albedo = mix(face, ink_tone, ink);
  // Colours that differ for the eye are often alike in the near infrared; retro tells them apart.
  return {albedo, mix(0.5F + 0.2F * face, 0.45F + 0.1F * ink_tone, ink), mix(retro, ink_retro, ink),
          0.0F, 0.06F};
}

}  // namespace

// p: width, height, kind, whether it throws light back. Kinds: 0 round, 1 name plate, 2 board,
// 3 triangle, 4 reflector, 5 direction board of a highway, 6 chevrons, 7 escape route.
Appearance sign(const Spot& s) {
  const float w = s.p[0];
  const float h = s.p[1];
  const float retro = s.p[3];
  const std::uint32_t key = hash(s.seed, 2U, 72U);
  const float x = s.u - 0.5F * w;
  const float y = s.v - 0.5F * h;
  switch (static_cast<int>(s.p[2])) {
    case 0: {
      const float r = std::sqrt(x * x + y * y) / w;
      const float ring = band(r, 0.37F, 0.6F, s.footprint / w);
      const float size = 0.4F * h;
      const int letters = 1 + static_cast<int>(key % 2U);
      const float from = 0.31F * static_cast<float>(letters);
      const float ink = r < 0.4F ? lettering(x / size + from + 0.08F * static_cast<float>(letters),
                                             y / size + 0.5F, s.footprint / size, key, letters)
                                 : 0.0F;
      Appearance result = painted(0.75F, 0.06F, ink, 0.8F * retro, 0.1F);
      result.albedo = mix(result.albedo, 0.16F, ring);
      result.retro = mix(result.retro, 0.4F * retro, ring);
      return result;
    }
    case 3: {
      // Distance to the three sides, from the middle of the outline's circle.
      const float side = 0.25F * h + y;
      const float slope = 0.25F * h - 0.5F * y + 0.866F * std::abs(x) * -1.0F;
      const float edge = std::min(side, slope);
      const float ring = 1.0F - band(edge, 0.07F * h, 10.0F, s.footprint);
      const float size = 0.34F * h;
      const float ink =
          letter(x / size + 0.31F, (y + 0.1F * h) / size + 0.35F, s.footprint / size, key);
      Appearance result = painted(0.75F, 0.06F, ink, 0.8F * retro, 0.1F);
      result.albedo = mix(result.albedo, 0.16F, ring);
      result.retro = mix(result.retro, 0.4F * retro, ring);
      return result;
    }
    case 4:
      return {0.8F, 0.8F, 1.0F, 0.0F, 0.1F};
    case 5: {
      const float border = 1.0F - band(s.u, 0.08F, w - 0.08F, s.footprint) *
                                      band(s.v, 0.08F, h - 0.08F, s.footprint);
      const int lines = std::max(1, static_cast<int>((h - 0.5F) / 0.62F));
      const float ink = std::max(border, text_lines(s, 0.35F, 0.38F, 0.22F, lines));
      return painted(0.13F, 0.75F, ink, 0.25F, 0.9F);
    }
    case 6: {
      const float arrow = repeated(s.u + std::abs(y), 0.6F, 0.3F, s.footprint);
      return painted(0.75F, 0.1F, arrow, 0.8F, 0.25F);
    }
    case 7: {
      const float run = letter(s.u / (0.8F * h) - 0.12F, s.v / (0.8F * h) - 0.12F,
                               s.footprint / (0.8F * h), 77U);  // the same symbol on all of them
      const float number = lettering((s.u - 0.95F * h) / (0.5F * h), (s.v - 0.25F * h) / (0.5F * h),
                                     s.footprint / (0.5F * h), key, 3);
      Appearance result = painted(0.18F, 0.8F, std::max(run, number), 0.2F, 0.5F);
      result.emission = 0.008F * result.albedo;  // 200 cd/m2 where it is white
      result.always_on = true;
      return result;
    }
    default: {
      const bool dark = unit(key + 1U) < 0.45F;
      const float face = dark ? 0.08F + 0.15F * unit(key + 2U) : 0.5F + 0.3F * unit(key + 2U);
      const float ink_tone = dark ? 0.75F : 0.08F;
      const float border = 1.0F - band(s.u, 0.06F * h, w - 0.06F * h, s.footprint) *
                                      band(s.v, 0.06F * h, h - 0.06F * h, s.footprint);
      const int lines = s.p[2] < 1.5F || h > 0.8F * w ? 1 : 1 + static_cast<int>((key >> 9U) % 2U);
      const float margin = 0.18F * h;
      const float gap = 0.12F * h;
      const float size =
          (h - 2.0F * margin - gap * static_cast<float>(lines - 1)) / static_cast<float>(lines);
      const float ink = std::max(border, text_lines(s, margin, size, gap, lines));
      const float dirt = 0.15F * octave(s.u, s.v, 0.25F, s.seed + 3U, s.footprint);
      Appearance result = painted(face * (1.0F + dirt), ink_tone, ink, 0.7F * retro * face,
                                  0.7F * retro * ink_tone);
      return result;
    }
  }
}

// p: width, height. Each car has a number of its own.
Appearance plate(const Spot& s) {
  const float h = s.p[1];
  const float ink = lettering((s.u - 0.05F) / (0.72F * h), (s.v - 0.14F * h) / (0.72F * h),
                              s.footprint / (0.72F * h), s.instance + 13U, 7);
  return painted(0.72F, 0.05F, ink, 0.6F, 0.05F);
}

}  // namespace topoloc::world::patterns
