// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace topoloc::map {

/// First bytes of an encoded depth image; a zstd frame of width x height u16 follows.
struct DepthHeader {
  static constexpr std::array<char, 4> kMagic{'T', 'D', 'Z', '1'};

  std::array<char, 4> magic = kMagic;
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
};
static_assert(sizeof(DepthHeader) == 12);

/// Throws MapError unless magic and size (1 to 64 Mpx) are right.
DepthHeader read_depth_header(std::span<const std::byte> data);

}  // namespace topoloc::map
