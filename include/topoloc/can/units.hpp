// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace topoloc::can {

enum class Quantity : std::uint8_t { kAcceleration, kAngularRate, kSpeed };

/// Factor from a unit as people write it in DBC files ("km/h", "kph", "deg/s", "m/s^2", "g", ...;
/// case and blanks do not matter) to the SI unit of the quantity (m/s^2, rad/s, m/s).
std::optional<double> si_factor(Quantity quantity, std::string_view unit);

/// The units known for a quantity, for error messages: "m/s, km/h, mph".
std::string known_units(Quantity quantity);

}  // namespace topoloc::can
