// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/stamps_file.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace topoloc::camera {
namespace {

constexpr std::size_t kDecimals = 9;

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) {
    return std::nullopt;
  }
  return value;
}

/// Decimal digits are taken as they stand: a double has not enough of them for Unix nanoseconds.
std::optional<std::int64_t> parse_time_ns(std::string_view text) {
  const std::size_t point = text.find('.');
  if (point == std::string_view::npos) {
    return whole_number(text);
  }
  std::string decimals(text.substr(point + 1));
  const auto seconds = whole_number(text.substr(0, point));
  if (!std::all_of(decimals.begin(), decimals.end(), [](char c) { return c >= '0' && c <= '9'; })) {
    return std::nullopt;
  }
  decimals.resize(kDecimals, '0');
  const auto nanoseconds = whole_number(decimals);
  constexpr std::int64_t kMaxSeconds = 9'000'000'000;
  if (!seconds || !nanoseconds || *seconds > kMaxSeconds) {
    return std::nullopt;
  }
  return *seconds * 1'000'000'000 + *nanoseconds;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  return text.substr(0, text.find_last_not_of(kSpace) + 1);
}

}  // namespace

std::vector<ImageStamp> read_stamps(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot be read");
  }
  // Nobody's camera is that fast: the unit is not what the numbers look like.
  constexpr std::int64_t kMinPeriod_ns = 10'000;
  std::vector<ImageStamp> stamps;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const auto fail = [&](const std::string& what) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": " + what);
    };
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') {
      continue;
    }
    const std::size_t separator = std::min(text.find_first_of(" \t,"), text.size());
    const std::string_view name =
        separator == text.size() ? std::string_view() : trimmed(text.substr(separator + 1));
    const auto time_ns = parse_time_ns(text.substr(0, separator));
    if (!time_ns) {
      fail("expected a time, in seconds with a decimal point or in whole nanoseconds, found '" +
           std::string(text.substr(0, separator)) + "'");
    }
    if (!stamps.empty()) {
      const std::int64_t step_ns = *time_ns - stamps.back().time_ns;
      if (step_ns <= 0) {
        fail("the time is not later than that of the line before");
      }
      if (step_ns < kMinPeriod_ns) {
        fail("only " + std::to_string(step_ns) +
             " ns after the line before: whole numbers are nanoseconds, seconds have a decimal "
             "point");
      }
      if (stamps.back().name.empty() != name.empty()) {
        fail("names of images are on some lines only");
      }
    }
    stamps.push_back({*time_ns, std::string(name)});
  }
  if (stamps.empty()) {
    throw std::runtime_error(file.string() + ": no time stamps");
  }
  return stamps;
}

}  // namespace topoloc::camera
