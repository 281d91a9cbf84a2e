// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include <cstdint>
#include <vector>

namespace topoloc::mapping {

/// The intensities of a view for people to look at: 1 to 255, 0 in holes. Scaled so that 98 % of
/// the visible points are at most 250: retro-reflectors must not turn all else black, and units
/// differ from scanner to scanner.
std::vector<std::uint8_t> intensity_image(const RenderedView& view);

}  // namespace topoloc::mapping
