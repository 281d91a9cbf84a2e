// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/pixel_layout.hpp"

#include <algorithm>
#include <array>
#include <linux/videodev2.h>

namespace topoloc::camera {
namespace {

constexpr std::array kByCost = {PixelLayout::kGrey, PixelLayout::kMjpeg, PixelLayout::kYuyv};

}  // namespace

std::uint32_t fourcc(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::kGrey:
      return V4L2_PIX_FMT_GREY;
    case PixelLayout::kMjpeg:
      return V4L2_PIX_FMT_MJPEG;
    case PixelLayout::kYuyv:
      return V4L2_PIX_FMT_YUYV;
  }
  return 0;
}

std::optional<PixelLayout> layout_of(std::uint32_t code) {
  if (code == V4L2_PIX_FMT_JPEG) {  // some drivers' name for the same
    return PixelLayout::kMjpeg;
  }
  const auto found = std::find_if(kByCost.begin(), kByCost.end(),
                                  [&](PixelLayout layout) { return fourcc(layout) == code; });
  return found == kByCost.end() ? std::nullopt : std::optional(*found);
}

std::string fourcc_text(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto letter = static_cast<char>(code >> shift & 0x7fU);
    text += letter > ' ' && letter < 0x7f ? letter : '.';
  }
  return text;
}

std::optional<PixelLayout> choose_layout(std::span<const std::uint32_t> offered,
                                         std::optional<PixelLayout> wanted) {
  for (const PixelLayout layout : kByCost) {
    const bool has = std::any_of(offered.begin(), offered.end(),
                                 [&](std::uint32_t code) { return layout_of(code) == layout; });
    if (has && (!wanted || *wanted == layout)) {
      return layout;
    }
  }
  return std::nullopt;
}

}  // namespace topoloc::camera
