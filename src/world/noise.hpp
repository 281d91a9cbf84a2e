// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

/// Value noise and filtered patterns for appearance(): no tables, no state.
///
/// Everything here is band-limited by a footprint [m]: a pattern that is finer gives its mean.
namespace topoloc::world::noise {

inline std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x85EBCA77U + y * 0xC2B2AE3DU + seed * 0x9E3779B1U;
  h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 12U)) * 0x297A2D39U;
  return h ^ (h >> 15U);
}

/// [0, 1)
inline float unit(std::uint32_t h) { return static_cast<float>(h >> 8U) * 0x1p-24F; }
inline float unit(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  return unit(hash(x, y, seed));
}
/// Another number of the same key.
inline std::uint32_t again(std::uint32_t h) { return hash(h, 0x51ED270BU, 0x2545F491U); }

inline std::int32_t floor_int(float x) {
  const auto i = static_cast<std::int32_t>(x);
  return i - static_cast<std::int32_t>(x < static_cast<float>(i));
}
/// std::floor, without a call into the mathematics library on older machines.
inline float whole(float x) { return static_cast<float>(floor_int(x)); }
inline std::uint32_t cell(float x) { return static_cast<std::uint32_t>(floor_int(x)); }

inline float mix(float a, float b, float share) { return a + (b - a) * share; }
inline float clamp01(float x) { return std::clamp(x, 0.0F, 1.0F); }

/// Smooth noise in [0, 1] with a cell of 1; mean 0.5.
inline float value(float x, float y, std::uint32_t seed) {
  const std::int32_t ix = floor_int(x);
  const std::int32_t iy = floor_int(y);
  float fx = x - static_cast<float>(ix);
  float fy = y - static_cast<float>(iy);
  fx = fx * fx * (3.0F - 2.0F * fx);
  fy = fy * fy * (3.0F - 2.0F * fy);
  const auto ux = static_cast<std::uint32_t>(ix);
  const auto uy = static_cast<std::uint32_t>(iy);
  const float bottom = mix(unit(ux, uy, seed), unit(ux + 1, uy, seed), fx);
  const float top = mix(unit(ux, uy + 1, seed), unit(ux + 1, uy + 1, seed), fx);
  return mix(bottom, top, fy);
}

/// How much of a pattern with cells of `cell_m` a spot of `footprint_m` still shows.
inline float fade(float cell_m, float footprint_m) {
  return clamp01((1.25F * cell_m - footprint_m) / (0.75F * cell_m));
}

/// Noise about 0, within +-0.5, that fades with the footprint.
inline float octave(float u_m, float v_m, float cell_m, std::uint32_t seed, float footprint_m) {
  const float share = fade(cell_m, footprint_m);
  if (share <= 0.0F) {
    return 0.0F;
  }
  return share * (value(u_m / cell_m, v_m / cell_m, seed) - 0.5F);
}

/// Share of a spot about x that lies in [low, high].
inline float band(float x, float low, float high, float footprint) {
  const float half = 0.5F * std::max(footprint, 1e-4F);
  return clamp01((std::min(x + half, high) - std::max(x - half, low)) / (2.0F * half));
}

/// Share of a spot about x that lies in [0, width] of a pattern repeated every `period`.
inline float repeated(float x, float period, float width, float footprint) {
  const float half = 0.5F * std::max(footprint, 1e-4F);
  const auto integral = [&](float t) {
    const auto n = static_cast<float>(floor_int(t / period));
    return n * width + std::min(t - n * period, width);
  };
  return clamp01((integral(x + half) - integral(x - half)) / (2.0F * half));
}

/// Grows from 0 to 1 between two limits.
inline float ramp(float x, float from, float to) { return clamp01((x - from) / (to - from)); }

}  // namespace topoloc::world::noise
