// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/message_check.hpp"

#include <array>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Over all of the bytes: the checksum itself stands elsewhere.
std::uint8_t over_all(Checksum algorithm, const Bytes& bytes) {
  return checksum(algorithm, std::nullopt, bytes, bytes.size());
}

TEST(Checksum, AgreesWithPublishedValues) {
  constexpr std::string_view kDigits = "123456789";
  const Bytes digits(kDigits.begin(), kDigits.end());
  EXPECT_EQ(over_all(Checksum::kCrc8J1850, digits), 0x4B);  // the catalogue's check value
  EXPECT_EQ(over_all(Checksum::kSum8, digits), 0xDD);       // 0x31 + ... + 0x39 = 0x1DD
  EXPECT_EQ(over_all(Checksum::kXor8, digits), 0x31);
}

TEST(Checksum, E2eProfile1AgreesWithKnownMessages) {
  // Data id 0x123, both bytes; checksum in byte 0, counter in the low half of byte 1.
  EXPECT_EQ(checksum(Checksum::kE2eProfile1, 0x123, Bytes{0xAA, 0, 0, 0, 0, 0, 0, 0}, 0), 0xCC);
  EXPECT_EQ(checksum(Checksum::kE2eProfile1, 0x123, Bytes{0xAA, 1, 0, 0, 0, 0, 0, 0}, 0), 0x91);
}

TEST(Checksum, SumTakesIdAndLengthAsDataId) {
  // Toyota: low byte of length + id (both bytes) + data without the last byte.
  const Bytes payload = {0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x00};
  EXPECT_EQ(checksum(Checksum::kSum8, 0x0825, payload, 7), (8 + 0x25 + 28) & 0xFF);
}

TEST(Checksum, EverySingleBitErrorIsFound) {
  for (const Checksum algorithm :
       {Checksum::kXor8, Checksum::kSum8, Checksum::kCrc8J1850, Checksum::kE2eProfile1}) {
    Bytes payload = {0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0x00};
    const std::uint8_t sound = checksum(algorithm, 0xBEEF, payload, 7);
    for (std::size_t bit = 0; bit < 56; ++bit) {
      payload[bit / 8] = static_cast<std::uint8_t>(payload[bit / 8] ^ 1U << bit % 8);
      EXPECT_NE(checksum(algorithm, 0xBEEF, payload, 7), sound);
      payload[bit / 8] = static_cast<std::uint8_t>(payload[bit / 8] ^ 1U << bit % 8);
    }
  }
}

}  // namespace
}  // namespace topoloc::can
