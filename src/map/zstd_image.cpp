// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map/zstd_image.hpp"

#include "topoloc/map/types.hpp"

#include <cstring>
#include <stdexcept>
#include <string>

#include <zstd.h>

namespace topoloc::map {
namespace {

constexpr std::uint64_t kMaxPixels = 64ULL << 20;
constexpr int kCompressionLevel = 9;

}  // namespace

ZstdImageHeader read_header(const ZstdImageKind& kind, std::span<const std::byte> data) {
  const std::string name = kind.name;
  ZstdImageHeader header;
  if (data.size() < sizeof(header)) {
    throw MapError(name + " of " + std::to_string(data.size()) +
                   " bytes is too short for its header");
  }
  std::memcpy(&header, data.data(), sizeof(header));
  if (header.magic != kind.magic) {
    throw MapError(name + " does not begin with " +
                   std::string(kind.magic.begin(), kind.magic.end()));
  }
  const std::uint64_t pixels = std::uint64_t{header.width_px} * header.height_px;
  if (pixels == 0 || pixels > kMaxPixels || header.width_px > kMaxPixels ||
      header.height_px > kMaxPixels) {
    throw MapError(name + " of " + std::to_string(header.width_px) + " x " +
                   std::to_string(header.height_px) + " px, expected 1 to 64 Mpx");
  }
  return header;
}

std::vector<std::byte> compress_image(const ZstdImageKind& kind, std::span<const std::byte> pixels,
                                      int width_px, int height_px) {
  const std::size_t count = pixels.size() / kind.bytes_per_pixel;
  if (width_px <= 0 || height_px <= 0 || count * kind.bytes_per_pixel != pixels.size() ||
      count != static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) ||
      count > kMaxPixels) {
    throw std::invalid_argument(std::string(kind.name) + ": " + std::to_string(count) +
                                " pixels for " + std::to_string(width_px) + " x " +
                                std::to_string(height_px) + " px");
  }
  const ZstdImageHeader header{kind.magic, static_cast<std::uint32_t>(width_px),
                               static_cast<std::uint32_t>(height_px)};
  std::vector<std::byte> data(sizeof(header) + ZSTD_compressBound(pixels.size()));
  std::memcpy(data.data(), &header, sizeof(header));
  const std::size_t size = ZSTD_compress(data.data() + sizeof(header), data.size() - sizeof(header),
                                         pixels.data(), pixels.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) {
    throw MapError(std::string("cannot compress a ") + kind.name + ": " + ZSTD_getErrorName(size));
  }
  data.resize(sizeof(header) + size);
  data.shrink_to_fit();
  return data;
}

void decompress_image(const ZstdImageKind& kind, std::span<const std::byte> data,
                      std::span<std::byte> pixels) {
  const std::string name = kind.name;
  const std::span<const std::byte> frame = data.subspan(sizeof(ZstdImageHeader));
  if (ZSTD_getFrameContentSize(frame.data(), frame.size()) != pixels.size()) {
    throw MapError(name + ": compressed data are damaged or not of the declared size");
  }
  const std::size_t size =
      ZSTD_decompress(pixels.data(), pixels.size(), frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != pixels.size()) {
    throw MapError(name + ": compressed data are damaged: " +
                   (ZSTD_isError(size) != 0 ? ZSTD_getErrorName(size) : "too short"));
  }
}

}  // namespace topoloc::map
