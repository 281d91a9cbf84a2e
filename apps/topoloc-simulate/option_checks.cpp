// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "option_checks.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <system_error>

#include <fmt/core.h>

CLI::Validator number_within(double least, double most) {
  const CLI::Range range(least, most);
  const auto check = [range](std::string& text) {
    const bool none = std::isnan(std::strtod(text.c_str(), nullptr));
    return none ? fmt::format("'{}' is not a number", text) : range(text);
  };
  return {check, range.get_description()};
}

CLI::Validator whole_number() {
  const auto check = [](std::string& text) {
    std::uint64_t number = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    if (text.empty() || error != std::errc() || rest != end) {
      return fmt::format("'{}' is not a whole number from 0 to {}", text,
                         std::numeric_limits<std::uint64_t>::max());
    }
    text = std::to_string(number);  // without zeros in front
    return std::string();
  };
  return {check, ""};
}
