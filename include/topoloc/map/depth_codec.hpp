// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace topoloc::map {

/// Compresses a depth image: u16 in 1/256 m (as KITTI's depth images), 0 = no depth, zstd.
///
/// `depth_m` is row-major, width_px x height_px, Z along the optical axis. The error is at most
/// 2 mm. Depths that are not positive, not finite or from 255.998 m on become "no depth".
/// Throws std::invalid_argument if the sizes disagree.
std::vector<std::byte> encode_depth(std::span<const float> depth_m, int width_px, int height_px);

/// Inverse of encode_depth(); depth in metres, 0 = none. Sets the image size.
/// Throws MapError on damaged data; never allocates more than the declared size (64 Mpx at most).
std::vector<float> decode_depth(std::span<const std::byte> data, int& width_px, int& height_px);

}  // namespace topoloc::map
