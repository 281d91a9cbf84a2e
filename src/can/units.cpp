// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/units.hpp"

#include <array>
#include <numbers>

namespace topoloc::can {
namespace {

struct Unit {
  Quantity quantity;
  std::string_view name;  ///< lower case, no blanks
  double to_si;
};

constexpr double kStandardGravity_mps2 = 9.80665;
constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kMilePerHour_mps = 0.44704;
constexpr double kFoot_m = 0.3048;

constexpr auto kUnits = std::to_array<Unit>({
    {Quantity::kAcceleration, "m/s^2", 1.0},
    {Quantity::kAcceleration, "m/s2", 1.0},
    {Quantity::kAcceleration, "m/s/s", 1.0},
    {Quantity::kAcceleration, "m/(s^2)", 1.0},
    {Quantity::kAcceleration, "m/s\xc2\xb2", 1.0},  // superscript two, UTF-8
    {Quantity::kAcceleration, "m/s\xb2", 1.0},      // the same, Latin-1
    {Quantity::kAcceleration, "mps2", 1.0},
    {Quantity::kAcceleration, "g", kStandardGravity_mps2},
    {Quantity::kAcceleration, "mg", 1e-3 * kStandardGravity_mps2},
    {Quantity::kAngularRate, "rad/s", 1.0},
    {Quantity::kAngularRate, "rad/sec", 1.0},
    {Quantity::kAngularRate, "radps", 1.0},
    {Quantity::kAngularRate, "mrad/s", 1e-3},
    {Quantity::kAngularRate, "deg/s", kDegree_rad},
    {Quantity::kAngularRate, "deg/sec", kDegree_rad},
    {Quantity::kAngularRate, "degree/s", kDegree_rad},
    {Quantity::kAngularRate, "degrees/s", kDegree_rad},
    {Quantity::kAngularRate, "dps", kDegree_rad},
    {Quantity::kAngularRate, "\xc2\xb0/s", kDegree_rad},  // degree sign, UTF-8
    {Quantity::kAngularRate, "\xb0/s", kDegree_rad},      // the same, Latin-1
    {Quantity::kSpeed, "m/s", 1.0},
    {Quantity::kSpeed, "mps", 1.0},
    {Quantity::kSpeed, "km/h", 1.0 / 3.6},
    {Quantity::kSpeed, "kph", 1.0 / 3.6},
    {Quantity::kSpeed, "kmh", 1.0 / 3.6},
    {Quantity::kSpeed, "km/hour", 1.0 / 3.6},
    {Quantity::kSpeed, "mph", kMilePerHour_mps},
    {Quantity::kSpeed, "mi/h", kMilePerHour_mps},
    {Quantity::kSpeed, "ft/s", kFoot_m},
});

}  // namespace

std::optional<double> si_factor(Quantity quantity, std::string_view unit) {
  std::string plain;
  for (const char c : unit) {
    if (c != ' ' && c != '\t') {
      plain += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    }
  }
  for (const Unit& known : kUnits) {
    if (known.quantity == quantity && known.name == plain) {
      return known.to_si;
    }
  }
  return std::nullopt;
}

std::string known_units(Quantity quantity) {
  switch (quantity) {
    case Quantity::kAcceleration:
      return "m/s^2, g, mg";
    case Quantity::kAngularRate:
      return "rad/s, mrad/s, deg/s";
    case Quantity::kSpeed:
      return "m/s, km/h, mph, ft/s";
  }
  return {};
}

}  // namespace topoloc::can
