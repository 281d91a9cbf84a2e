// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace topoloc::evaluation {

/// Median of values in any order (of an even number the upper of the two in the middle); 0 of none.
template <typename T>
T median(std::vector<T> values) {
  if (values.empty()) {
    return T{};
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Value of values in any order that the given share of them (0 to 1) does not exceed; 0 of none.
template <typename T>
T quantile(std::vector<T> values, double share) {
  if (values.empty()) {
    return T{};
  }
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace topoloc::evaluation
