// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/random.hpp"

#include <vector>

namespace topoloc::world {

/// begin, begin + step and so on, all below `end`.
inline std::vector<double> steps(double begin, double end, double step) {
  std::vector<double> result;
  for (int i = 0; begin + i * step < end; ++i) {
    result.push_back(begin + i * step);
  }
  return result;
}

/// Places at random distances between `from` and `to` of each other.
inline std::vector<double> random_steps(Random& random, double begin, double end, double from,
                                        double to) {
  std::vector<double> result;
  double place = begin;
  while (place < end) {
    result.push_back(place);
    place += random.uniform(from, to);
  }
  return result;
}

}  // namespace topoloc::world
