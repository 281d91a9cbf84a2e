// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/signal_coding.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace topoloc::can {
namespace {

/// Numbers bits in the order in which a Motorola signal runs through the payload: most significant
/// bit of byte 0 first. The same number backwards for the other direction.
std::size_t sequential(std::size_t dbc_bit) { return dbc_bit / 8 * 8 + (7 - dbc_bit % 8); }

std::uint64_t mask(unsigned length_bits) {
  return length_bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << length_bits) - 1;
}

/// Calls piece(byte_index, lowest_bit, bit_count) for every byte that the signal touches, most
/// significant part first.
template <typename Piece>
void for_each_piece(const SignalCoding& coding, Piece&& piece) {
  if (coding.byte_order == ByteOrder::kMotorola) {
    std::size_t bit = sequential(coding.start_bit);
    for (unsigned left = coding.length_bits; left > 0;) {
      const auto in_byte = static_cast<unsigned>(bit % 8);  // counted from the most significant
      const unsigned count = std::min(8 - in_byte, left);
      piece(bit / 8, 8 - in_byte - count, count);
      bit += count;
      left -= count;
    }
    return;
  }
  std::size_t end = std::size_t{coding.start_bit} + coding.length_bits;
  for (unsigned left = coding.length_bits; left > 0;) {
    const std::size_t byte = (end - 1) / 8;
    const unsigned count = std::min(static_cast<unsigned>(end - byte * 8), left);
    piece(byte, static_cast<unsigned>(end - byte * 8) - count, count);
    end -= count;
    left -= count;
  }
}

double to_number(const SignalCoding& coding, std::uint64_t raw) {
  switch (coding.value_type) {
    case ValueType::kUnsigned:
      return static_cast<double>(raw);
    case ValueType::kSigned: {
      const unsigned unused = 64U - coding.length_bits;
      return static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
    }
    case ValueType::kFloat32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
    case ValueType::kFloat64:
      return std::bit_cast<double>(raw);
  }
  return 0.0;
}

/// Raw bits of a number in raw units; nothing if the signal cannot hold it.
std::optional<std::uint64_t> to_raw(const SignalCoding& coding, double number) {
  if (coding.value_type == ValueType::kFloat64) {
    return std::bit_cast<std::uint64_t>(number);
  }
  if (coding.value_type == ValueType::kFloat32) {
    const auto single = static_cast<float>(number);
    if (!std::isfinite(single)) {
      return std::nullopt;
    }
    return std::bit_cast<std::uint32_t>(single);
  }
  const double rounded = std::round(number);
  if (coding.value_type == ValueType::kSigned) {
    const double limit = std::ldexp(1.0, coding.length_bits - 1);
    if (rounded < -limit || rounded >= limit) {
      return std::nullopt;
    }
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded));
  }
  if (rounded < 0.0 || rounded >= std::ldexp(1.0, coding.length_bits)) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(rounded);
}

bool fits(const SignalCoding& coding, std::size_t payload_bytes) {
  return coding.length_bits >= 1 && coding.length_bits <= 64 &&
         payload_bytes >= coding.required_bytes();
}

}  // namespace

std::size_t SignalCoding::required_bytes() const {
  const std::size_t first =
      byte_order == ByteOrder::kMotorola ? sequential(start_bit) : std::size_t{start_bit};
  return (first + length_bits + 7) / 8;
}

std::optional<std::uint64_t> extract_raw(const SignalCoding& coding,
                                         std::span<const std::uint8_t> payload) {
  if (!fits(coding, payload.size())) {
    return std::nullopt;
  }
  std::uint64_t raw = 0;
  for_each_piece(coding, [&](std::size_t byte, unsigned lowest_bit, unsigned count) {
    const std::uint64_t bits = (std::uint64_t{payload[byte]} >> lowest_bit) & mask(count);
    raw = (raw << count) | bits;
  });
  return raw;
}

std::optional<double> decode(const SignalCoding& coding, std::span<const std::uint8_t> payload) {
  const auto raw = extract_raw(coding, payload);
  if (!raw) {
    return std::nullopt;
  }
  return to_number(coding, *raw) * coding.scale + coding.offset;
}

bool encode(const SignalCoding& coding, double physical, std::span<std::uint8_t> payload) {
  const double number = (physical - coding.offset) / coding.scale;
  if (!std::isfinite(number) || !fits(coding, payload.size())) {
    return false;
  }
  const auto raw = to_raw(coding, number);
  if (!raw) {
    return false;
  }
  unsigned left = coding.length_bits;
  for_each_piece(coding, [&](std::size_t byte, unsigned lowest_bit, unsigned count) {
    left -= count;
    const auto bits = static_cast<unsigned>((*raw >> left) & mask(count)) << lowest_bit;
    const auto cleared = payload[byte] & ~(static_cast<unsigned>(mask(count)) << lowest_bit);
    payload[byte] = static_cast<std::uint8_t>(cleared | bits);
  });
  return true;
}

}  // namespace topoloc::can
