// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/intensity_codec.hpp"

#include "map/zstd_image.hpp"

namespace topoloc::map {

std::vector<std::byte> encode_intensity(std::span<const std::uint8_t> intensity, int width_px,
                                        int height_px) {
  return compress_image(kIntensityKind, std::as_bytes(intensity), width_px, height_px);
}

std::vector<std::uint8_t> decode_intensity(std::span<const std::byte> data, int& width_px,
                                           int& height_px) {
  const ZstdImageHeader header = read_header(kIntensityKind, data);
  std::vector<std::uint8_t> intensity(std::size_t{header.width_px} * header.height_px);
  decompress_image(kIntensityKind, data, std::as_writable_bytes(std::span(intensity)));
  width_px = static_cast<int>(header.width_px);
  height_px = static_cast<int>(header.height_px);
  return intensity;
}

}  // namespace topoloc::map
