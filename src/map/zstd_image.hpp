// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// What the compressed images of a node have in common: a header of 12 bytes, then one zstd frame
/// of width x height pixels of a fixed size.
namespace topoloc::map {

/// A kind of image: first bytes and name in errors.
struct ZstdImageKind {
  std::array<char, 4> magic;
  const char* name;
  std::size_t bytes_per_pixel;
};
inline constexpr ZstdImageKind kDepthKind{{'T', 'D', 'Z', '1'}, "depth image", 2};
inline constexpr ZstdImageKind kIntensityKind{{'T', 'I', 'Z', '1'}, "intensity image", 1};

struct ZstdImageHeader {
  std::array<char, 4> magic{};
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
};
static_assert(sizeof(ZstdImageHeader) == 12);

/// Throws MapError unless magic and size (1 to 64 Mpx) are right.
ZstdImageHeader read_header(const ZstdImageKind& kind, std::span<const std::byte> data);

/// `pixels` row-major. Throws std::invalid_argument if the sizes disagree.
std::vector<std::byte> compress_image(const ZstdImageKind& kind, std::span<const std::byte> pixels,
                                      int width_px, int height_px);

/// Inverse of compress_image() into `pixels`, which has the size that read_header() tells.
/// Throws MapError on damaged data.
void decompress_image(const ZstdImageKind& kind, std::span<const std::byte> data,
                      std::span<std::byte> pixels);

}  // namespace topoloc::map
