// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/intensity_image.hpp"

#include "topoloc/evaluation/median.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace topoloc::mapping {
namespace {

constexpr double kBrightShare = 0.98;
constexpr float kBrightCode = 250.0F;

/// Intensity that the given share of the visible points does not exceed; 0 without any.
float bright_intensity(const RenderedView& view) {
  std::vector<float> visible;
  for (std::size_t i = 0; i < view.point.size(); ++i) {
    if (view.point[i] != RenderedView::kHole && std::isfinite(view.intensity[i])) {
      visible.push_back(view.intensity[i]);
    }
  }
  return evaluation::quantile(std::move(visible), kBrightShare);
}

}  // namespace

std::vector<std::uint8_t> intensity_image(const RenderedView& view) {
  const float bright = bright_intensity(view);
  const float scale = bright > 0.0F ? kBrightCode / bright : 0.0F;
  std::vector<std::uint8_t> image(view.point.size(), 0);
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (view.point[i] != RenderedView::kHole) {
      const float code = std::round(scale * view.intensity[i]);
      // Written so that NaN becomes the darkest point, not a hole.
      image[i] = code > 1.0F ? static_cast<std::uint8_t>(std::min(code, 255.0F)) : std::uint8_t{1};
    }
  }
  return image;
}

}  // namespace topoloc::mapping
