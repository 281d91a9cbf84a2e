// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/triangle_hit.hpp"

#include <cstdint>

namespace topoloc::rendering {

/// The facet that a triangle is, or is half of: rectangles are two triangles, one after the other.
Facet facet_of(const Placed& placed, std::uint32_t triangle);

}  // namespace topoloc::rendering
