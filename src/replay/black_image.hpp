// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace topoloc::replay {

/// The image_t with all its pixels black, in the same size and format. `message` is a valid one.
std::vector<std::byte> black_image(std::span<const std::byte> message);

}  // namespace topoloc::replay
