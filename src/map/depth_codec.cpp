// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/depth_codec.hpp"

#include "topoloc/map/types.hpp"

#include "map/depth_header.hpp"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <zstd.h>

namespace topoloc::map {
namespace {

constexpr float kStepsPerMetre = 256.0F;
constexpr float kLargestCode = 65535.0F;
constexpr std::uint64_t kMaxPixels = 64ULL << 20;
constexpr int kCompressionLevel = 9;

std::uint16_t encode(float depth_m) {
  const float code = std::round(depth_m * kStepsPerMetre);
  // Written so that NaN fails too. A positive depth never rounds to "no depth".
  if (!(depth_m > 0.0F && code <= kLargestCode)) {
    return 0;
  }
  return code < 1.0F ? std::uint16_t{1} : static_cast<std::uint16_t>(code);
}

}  // namespace

DepthHeader read_depth_header(std::span<const std::byte> data) {
  DepthHeader header;
  if (data.size() < sizeof(header)) {
    throw MapError("depth image of " + std::to_string(data.size()) +
                   " bytes is too short for its header");
  }
  std::memcpy(&header, data.data(), sizeof(header));
  if (header.magic != DepthHeader::kMagic) {
    throw MapError("depth image does not begin with TDZ1");
  }
  const std::uint64_t pixels = std::uint64_t{header.width_px} * header.height_px;
  if (pixels == 0 || pixels > kMaxPixels || header.width_px > kMaxPixels ||
      header.height_px > kMaxPixels) {
    throw MapError("depth image of " + std::to_string(header.width_px) + " x " +
                   std::to_string(header.height_px) + " px, expected 1 to 64 Mpx");
  }
  return header;
}

std::vector<std::byte> encode_depth(std::span<const float> depth_m, int width_px, int height_px) {
  if (width_px <= 0 || height_px <= 0 ||
      depth_m.size() != static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) ||
      depth_m.size() > kMaxPixels) {
    throw std::invalid_argument("encode_depth: " + std::to_string(depth_m.size()) + " depths for " +
                                std::to_string(width_px) + " x " + std::to_string(height_px) +
                                " px");
  }
  std::vector<std::uint16_t> codes(depth_m.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    codes[i] = encode(depth_m[i]);
  }
  DepthHeader header;
  header.width_px = static_cast<std::uint32_t>(width_px);
  header.height_px = static_cast<std::uint32_t>(height_px);

  const std::size_t raw_size = codes.size() * sizeof(std::uint16_t);
  std::vector<std::byte> data(sizeof(header) + ZSTD_compressBound(raw_size));
  std::memcpy(data.data(), &header, sizeof(header));
  const std::size_t size = ZSTD_compress(data.data() + sizeof(header), data.size() - sizeof(header),
                                         codes.data(), raw_size, kCompressionLevel);
  if (ZSTD_isError(size) != 0) {
    throw MapError(std::string("cannot compress a depth image: ") + ZSTD_getErrorName(size));
  }
  data.resize(sizeof(header) + size);
  data.shrink_to_fit();
  return data;
}

std::vector<float> decode_depth(std::span<const std::byte> data, int& width_px, int& height_px) {
  const DepthHeader header = read_depth_header(data);
  const std::size_t pixels = std::size_t{header.width_px} * header.height_px;
  const std::span<const std::byte> frame = data.subspan(sizeof(header));
  const std::size_t raw_size = pixels * sizeof(std::uint16_t);
  if (ZSTD_getFrameContentSize(frame.data(), frame.size()) != raw_size) {
    throw MapError("depth image: compressed data are damaged or not of the declared size");
  }
  std::vector<std::uint16_t> codes(pixels);
  const std::size_t size = ZSTD_decompress(codes.data(), raw_size, frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != raw_size) {
    throw MapError(std::string("depth image: compressed data are damaged: ") +
                   (ZSTD_isError(size) != 0 ? ZSTD_getErrorName(size) : "too short"));
  }
  width_px = static_cast<int>(header.width_px);
  height_px = static_cast<int>(header.height_px);
  std::vector<float> depth_m(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    depth_m[i] = static_cast<float>(codes[i]) / kStepsPerMetre;
  }
  return depth_m;
}

}  // namespace topoloc::map
