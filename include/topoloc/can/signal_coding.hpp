// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// From bits of a payload to a physical value and back. No allocation, no exceptions.
namespace topoloc::can {

enum class ByteOrder : std::uint8_t {
  kIntel,     ///< little endian, "@1": start_bit is the least significant bit
  kMotorola,  ///< big endian, "@0": start_bit is the most significant bit
};

enum class ValueType : std::uint8_t { kUnsigned, kSigned, kFloat32, kFloat64 };

/// Where a signal lies in the payload and how its raw value maps to the physical one.
/// Bits are numbered as in DBC files: bit b is bit b % 8 (0 = least significant) of byte b / 8.
struct SignalCoding {
  std::uint16_t start_bit = 0;
  std::uint16_t length_bits = 1;  ///< 1 to 64; 32 or 64 for floats
  ByteOrder byte_order = ByteOrder::kIntel;
  ValueType value_type = ValueType::kUnsigned;
  double scale = 1.0;  ///< physical = raw * scale + offset
  double offset = 0.0;

  /// Bytes that a payload must have so that all bits of the signal are in it.
  [[nodiscard]] std::size_t required_bytes() const;
};

/// The signal's bits, right-aligned, neither sign-extended nor scaled; nothing if the payload is
/// too short (or the signal longer than 64 bits).
std::optional<std::uint64_t> extract_raw(const SignalCoding& coding,
                                         std::span<const std::uint8_t> payload);

/// Physical value in the DBC's unit; nothing if the payload is too short.
std::optional<double> decode(const SignalCoding& coding, std::span<const std::uint8_t> payload);

/// Writes the raw value nearest to a physical value (in the DBC's unit) and leaves all other bits
/// alone. False, and nothing written, if the payload is too short, the value is not finite or the
/// signal's bits cannot hold it.
bool encode(const SignalCoding& coding, double physical, std::span<std::uint8_t> payload);

}  // namespace topoloc::can
