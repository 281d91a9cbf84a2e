// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/signal_coding.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(SignalCoding, MotorolaStartBitIsTheMostSignificantOne) {
  // Toyota's WHEEL_SPEED_FR, 6|15@0+: all bits of byte 0 but the highest, then byte 1.
  const SignalCoding coding{.start_bit = 6,
                            .length_bits = 15,
                            .byte_order = ByteOrder::kMotorola,
                            .scale = 0.01,
                            .offset = -67.67};
  EXPECT_NEAR(*decode(coding, Bytes{0x9A, 0x6F}), 0x1A6F * 0.01 - 67.67, 1e-12);
  EXPECT_EQ(*extract_raw(coding, Bytes{0x80, 0x01}), 1U);
  EXPECT_EQ(*extract_raw(coding, Bytes{0x40, 0x00}), 0x4000U);
}

TEST(SignalCoding, IntelStartBitIsTheLeastSignificantOne) {
  const SignalCoding coding{.start_bit = 12, .length_bits = 12};
  EXPECT_EQ(*extract_raw(coding, Bytes{0xFF, 0x3F, 0xA5}), 0xA53U);
}

TEST(SignalCoding, SignExtendsFromTheTopBit) {
  const SignalCoding coding{.start_bit = 3,
                            .length_bits = 12,
                            .byte_order = ByteOrder::kMotorola,
                            .value_type = ValueType::kSigned,
                            .scale = 1.5};
  EXPECT_DOUBLE_EQ(*decode(coding, Bytes{0x0F, 0xFF}), -1.5);
  EXPECT_DOUBLE_EQ(*decode(coding, Bytes{0xF8, 0x00}), -2048 * 1.5);
  EXPECT_DOUBLE_EQ(*decode(coding, Bytes{0x07, 0xFF}), 2047 * 1.5);
}

TEST(SignalCoding, DecodesSixtyFourBitsAcrossNineBytes) {
  const SignalCoding coding{.start_bit = 4, .length_bits = 64};
  const Bytes payload{0xF0, 0xDE, 0xBC, 0x9A, 0x78, 0x56, 0x34, 0x12, 0x0A};
  EXPECT_EQ(*extract_raw(coding, payload), 0xA123456789ABCDEFU);
}

TEST(SignalCoding, DecodesFloats) {
  Bytes payload(8);
  const SignalCoding single{.length_bits = 32, .value_type = ValueType::kFloat32, .scale = 2.0};
  ASSERT_TRUE(encode(single, 3.0, payload));
  EXPECT_EQ(*extract_raw(single, payload), std::bit_cast<std::uint32_t>(1.5F));
  const SignalCoding full{.start_bit = 7,
                          .length_bits = 64,
                          .byte_order = ByteOrder::kMotorola,
                          .value_type = ValueType::kFloat64};
  ASSERT_TRUE(encode(full, -1.0 / 3.0, payload));
  EXPECT_EQ(*decode(full, payload), -1.0 / 3.0);
  EXPECT_FALSE(encode(single, 1e39, payload)) << "beyond a float";
}

TEST(SignalCoding, PayloadThatEndsWithinTheSignalIsNoValue) {
  const SignalCoding motorola{
      .start_bit = 6, .length_bits = 15, .byte_order = ByteOrder::kMotorola};
  const SignalCoding intel{.start_bit = 8, .length_bits = 1};
  EXPECT_FALSE(decode(motorola, Bytes{0x12}));
  EXPECT_FALSE(decode(intel, Bytes{0x12}));
  EXPECT_TRUE(decode(intel, Bytes{0x12, 0x01}));
  EXPECT_FALSE(decode(SignalCoding{.start_bit = 65535, .length_bits = 64}, Bytes(64)));
  EXPECT_FALSE(decode(SignalCoding{.length_bits = 0}, Bytes(8)));
}

TEST(SignalCoding, EncodeRoundsAndRefusesWhatDoesNotFit) {
  const SignalCoding coding{.length_bits = 8, .value_type = ValueType::kSigned, .scale = 0.1};
  Bytes payload(1);
  ASSERT_TRUE(encode(coding, 1.26, payload));
  EXPECT_EQ(payload[0], 13);
  ASSERT_TRUE(encode(coding, -12.84, payload));
  EXPECT_EQ(payload[0], 0x80);
  payload[0] = 0x55;
  EXPECT_FALSE(encode(coding, 12.8, payload));
  EXPECT_FALSE(encode(coding, std::nan(""), payload));
  EXPECT_FALSE(encode(coding, std::numeric_limits<double>::infinity(), payload));
  EXPECT_FALSE(encode(coding, 0.0, std::span<std::uint8_t>{}));
  EXPECT_EQ(payload[0], 0x55) << "a refused value must not be written";
}

TEST(SignalCoding, EncodeAndExtractAreInverseAndTouchNoOtherBit) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 5000; ++round) {
    SignalCoding coding{.start_bit = static_cast<std::uint16_t>(random() % 448),
                        .length_bits = static_cast<std::uint16_t>(1 + random() % 52),
                        .byte_order = random() % 2 == 0 ? ByteOrder::kIntel : ByteOrder::kMotorola};
    const std::uint64_t raw = random() >> (64 - coding.length_bits);
    Bytes zeros(64, 0x00);
    Bytes ones(64, 0xFF);
    ASSERT_TRUE(encode(coding, static_cast<double>(raw), zeros));
    ASSERT_TRUE(encode(coding, static_cast<double>(raw), ones));
    EXPECT_EQ(*extract_raw(coding, zeros), raw);
    EXPECT_EQ(*extract_raw(coding, ones), raw);
    int differing_bits = 0;
    for (std::size_t i = 0; i < zeros.size(); ++i) {
      differing_bits += std::popcount(static_cast<unsigned>(zeros[i] ^ ones[i]));
    }
    EXPECT_EQ(differing_bits, 512 - coding.length_bits);
    EXPECT_FALSE(extract_raw(coding, std::span(zeros).first(coding.required_bytes() - 1)));
  }
}

}  // namespace
}  // namespace topoloc::can
