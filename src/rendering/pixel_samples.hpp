// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>

namespace topoloc::rendering {

inline constexpr int kMostSamples = 16;

/// One sample of a pixel: where in it, and when in its exposure, 0 to 1.
struct PixelSample {
  double x = 0.5;
  double y = 0.5;
  double time = 0.5;
};

/// Samples of a pixel: each in a row, a column and a time slot of its own. The same for all pixels,
/// since other places in every pixel would be noise on edges.
inline std::array<PixelSample, kMostSamples> pixel_samples(int count) {
  const auto turned = [](int i, int base) {  // van der Corput
    double value = 0.0;
    double digit = 1.0 / base;
    while (i > 0) {
      value += (i % base) * digit;
      i /= base;
      digit /= base;
    }
    return value;
  };
  std::array<PixelSample, kMostSamples> samples;
  std::array<int, kMostSamples> rows{};
  std::array<int, kMostSamples> slots{};
  for (int i = 0; i < count; ++i) {  // ranks of the sequences: exact slots for every count
    for (int j = 0; j < count; ++j) {
      rows[static_cast<std::size_t>(i)] += turned(j, 2) < turned(i, 2) ? 1 : 0;
      slots[static_cast<std::size_t>(i)] += turned(j, 3) < turned(i, 3) ? 1 : 0;
    }
  }
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    samples[at] = {(i + 0.5) / count, (rows[at] + 0.5) / count, (slots[at] + 0.5) / count};
  }
  return samples;
}

}  // namespace topoloc::rendering
