// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace topoloc::map {

/// Compresses a LiDAR intensity image without loss: row-major, 1 to 255, 0 = no point; zstd.
/// Throws std::invalid_argument if the sizes disagree.
std::vector<std::byte> encode_intensity(std::span<const std::uint8_t> intensity, int width_px,
                                        int height_px);

/// Inverse of encode_intensity(). Sets the image size.
/// Throws MapError on damaged data; never allocates more than the declared size (64 Mpx at most).
std::vector<std::uint8_t> decode_intensity(std::span<const std::byte> data, int& width_px,
                                           int& height_px);

}  // namespace topoloc::map
