// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/median.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace topoloc::mapping {

double CloudGrid::median_spacing_m() const {
  constexpr std::uint64_t kSamples = 256;
  const std::uint64_t count = cloud_.size();
  std::vector<float> squared_m2;
  for (std::uint64_t k = 0; k < std::min(kSamples, count); ++k) {
    const auto i = static_cast<std::uint32_t>(k * count / std::min(kSamples, count));
    const auto cell =
        std::upper_bound(cells().begin(), cells().end(), i,
                         [](std::uint32_t point, const Cell& c) { return point < c.end; });
    about_to_read(cell->end - cell->begin);
    // Neighbours across the border of the cell are missed: the median bears that.
    float nearest_m2 = std::numeric_limits<float>::infinity();
    for (std::uint32_t j = cell->begin; j < cell->end; ++j) {
      if (j != i) {
        nearest_m2 =
            std::min(nearest_m2, (cloud_.positions_m[j] - cloud_.positions_m[i]).squaredNorm());
      }
    }
    if (std::isfinite(nearest_m2)) {
      squared_m2.push_back(nearest_m2);
    }
  }
  return std::sqrt(static_cast<double>(evaluation::median(std::move(squared_m2))));
}

}  // namespace topoloc::mapping
