// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/image_pair_matcher.hpp"

#include <vector>

namespace topoloc::matching {

/// Removes matches that are not finite, outside of an image, or whose nearest pixel is masked.
void remove_unusable(const MaskedImage& image0, const MaskedImage& image1,
                     std::vector<PixelMatch>& matches);

/// Surest first; those that are equally sure keep their order.
void sort_by_confidence(std::vector<PixelMatch>& matches);

}  // namespace topoloc::matching
