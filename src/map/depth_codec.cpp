// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/depth_codec.hpp"

#include "map/zstd_image.hpp"

#include <cmath>
#include <cstdint>

namespace topoloc::map {
namespace {

constexpr float kStepsPerMetre = 256.0F;
constexpr float kLargestCode = 65535.0F;

std::uint16_t encode(float depth_m) {
  const float code = std::round(depth_m * kStepsPerMetre);
  // Written so that NaN fails too. A positive depth never rounds to "no depth".
  if (!(depth_m > 0.0F && code <= kLargestCode)) {
    return 0;
  }
  return code < 1.0F ? std::uint16_t{1} : static_cast<std::uint16_t>(code);
}

}  // namespace

std::vector<std::byte> encode_depth(std::span<const float> depth_m, int width_px, int height_px) {
  std::vector<std::uint16_t> codes(depth_m.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    codes[i] = encode(depth_m[i]);
  }
  return compress_image(kDepthKind, std::as_bytes(std::span(codes)), width_px, height_px);
}

std::vector<float> decode_depth(std::span<const std::byte> data, int& width_px, int& height_px) {
  const ZstdImageHeader header = read_header(kDepthKind, data);
  std::vector<std::uint16_t> codes(std::size_t{header.width_px} * header.height_px);
  decompress_image(kDepthKind, data, std::as_writable_bytes(std::span(codes)));
  width_px = static_cast<int>(header.width_px);
  height_px = static_cast<int>(header.height_px);
  std::vector<float> depth_m(codes.size());
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    depth_m[i] = static_cast<float>(codes[i]) / kStepsPerMetre;
  }
  return depth_m;
}

}  // namespace topoloc::map
