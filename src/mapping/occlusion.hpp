// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include <cstddef>
#include <vector>

namespace topoloc::mapping {

/// Pixels whose point is hidden: nearer points surround it. A plain larger splat would also hide
/// the ground behind the ground (its depth changes by 10 % within a few pixels) and whatever
/// stands beside an edge; nearer points on one side only hide nothing.
/// The idea of judging points by the free angle around them: R. Pintus, E. Gobbetti, M. Agus,
/// "Real-time rendering of massive unstructured raw point clouds using screen-space operators",
/// 2011.
std::vector<std::size_t> hidden_pixels(const RenderedView& view, const RenderConfig& config);

}  // namespace topoloc::mapping
