// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/dbc.hpp"

#include <array>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

Dbc parse(const std::string& text) { return Dbc::parse(text, "car.dbc"); }

constexpr auto kCarDbc = R"(VERSION ""

NS_ :
	NS_DESC_
	CM_
	VAL_

BS_:

BU_: ECU_A
  ECU_B

BO_ 170 WHEELS: 8 ECU_A
 SG_ SPEED_FL : 6|15@0+ (0.01,-67.67) [0|250] "km/h" ECU_B,Vector__XXX
 SG_ SPEED_FR : 24|16@1- (+1E-002,.5) [0|0] "" ECU_B

BO_ 2364540158 ENGINE: 8 ECU_A
 SG_ GEAR : 0|4@1+ (1,0) [0|15] "" ECU_B

BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX
 SG_ OVERLAPPING : 0|200@1+ (1,0) [0|0] "" Vector__XXX

CM_ SG_ 170 SPEED_FL "A comment; over
BO_ 1 several lines: with \"quotes\" and SG_ in it";
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_ "GenMsgCycleTime" BO_ 170 20;
VAL_TABLE_ Gears 1 "R" 0 "P" ;
VAL_ 2364540158 GEAR 0 "P" 1 "R" -1 "not; valid" ;
VAL_ SomeEnvironmentVariable 0 "off" ;
VAL_ 999 NOWHERE 0 "off" ;
)";

TEST(Dbc, ReadsMessagesAndSignals) {
  const Dbc dbc = parse(kCarDbc);
  ASSERT_EQ(dbc.messages().size(), 3U);
  const Message* wheels = dbc.find(170, false);
  ASSERT_NE(wheels, nullptr);
  EXPECT_EQ(wheels->length_bytes, 8);
  const Signal& left = *dbc.signal("WHEELS.SPEED_FL").signal;
  EXPECT_EQ(left.coding.start_bit, 6);
  EXPECT_EQ(left.coding.length_bits, 15);
  EXPECT_EQ(left.coding.byte_order, ByteOrder::kMotorola);
  EXPECT_EQ(left.coding.value_type, ValueType::kUnsigned);
  EXPECT_DOUBLE_EQ(left.coding.offset, -67.67);
  EXPECT_TRUE(left.has_limits());
  EXPECT_EQ(left.unit, "km/h");
  const Signal& right = *dbc.signal("WHEELS.SPEED_FR").signal;
  EXPECT_EQ(right.coding.byte_order, ByteOrder::kIntel);
  EXPECT_EQ(right.coding.value_type, ValueType::kSigned);
  EXPECT_DOUBLE_EQ(right.coding.scale, 0.01);
  EXPECT_DOUBLE_EQ(right.coding.offset, 0.5);
  EXPECT_FALSE(right.has_limits()) << "[0|0] means that none are given";
}

TEST(Dbc, TellsExtendedFromStandardIds) {
  const Dbc dbc = parse(kCarDbc);
  ASSERT_NE(dbc.find(0x0CF004FE, true), nullptr);
  EXPECT_EQ(dbc.find(0x0CF004FE, false), nullptr);
  EXPECT_EQ(dbc.find(170, true), nullptr);
}

TEST(Dbc, KeepsValueNames) {
  const Dbc dbc = parse(kCarDbc);
  const auto& names = dbc.signal("ENGINE.GEAR").signal->value_names;
  ASSERT_EQ(names.size(), 3U);
  EXPECT_EQ(names[1], (std::pair<std::int64_t, std::string>{1, "R"}));
  EXPECT_EQ(names[2], (std::pair<std::int64_t, std::string>{-1, "not; valid"}));
}

TEST(Dbc, ReadsWindowsLineEndsAndByteOrderMark) {
  std::string text = "\xEF\xBB\xBF";
  for (const char c : std::string(kCarDbc)) {
    text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  }
  EXPECT_EQ(parse(text).messages().size(), 3U);
  EXPECT_EQ(parse(text).signal("WHEELS.SPEED_FL").signal->unit, "km/h");
}

TEST(Dbc, UnknownNamesSuggestCloseOnes) {
  const Dbc dbc = parse(kCarDbc);
  EXPECT_THAT([&] { (void)dbc.signal("WHEEL.SPEED_FL"); },
              ThrowsMessage<std::runtime_error>(AllOf(
                  StartsWith("car.dbc: "), HasSubstr("no message 'WHEEL'"), HasSubstr("WHEELS"))));
  EXPECT_THAT([&] { (void)dbc.signal("WHEELS.speed_fl"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("SPEED_FL, SPEED_FR")));
  EXPECT_THAT([&] { (void)dbc.signal("WHEELS"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("MESSAGE.SIGNAL")));
  EXPECT_THAT([&] { (void)dbc.signal("VECTOR__INDEPENDENT_SIG_MSG.OVERLAPPING"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("200 bits")));
}

constexpr auto kMultiplexed = R"(BO_ 100 MUX: 8 A
 SG_ Selector M : 0|8@1+ (1,0) [0|0] "" B
 SG_ Inner m0M : 8|8@1+ (1,0) [0|0] "" B
 SG_ Direct m3 : 8|8@1+ (1,0) [0|0] "" B
 SG_ Nested m0 : 16|8@1+ (1,0) [0|0] "" B
 SG_ Always : 56|8@1+ (1,0) [0|0] "" B
)";

TEST(Dbc, MultiplexedSignalIsPresentForItsValueOnly) {
  const Dbc dbc = parse(kMultiplexed);
  const auto [message, direct] = dbc.signal("MUX.Direct");
  const Signal* always = dbc.signal("MUX.Always").signal;
  std::array<std::uint8_t, 8> payload{3};
  EXPECT_TRUE(is_present(*message, *direct, payload));
  payload[0] = 2;
  EXPECT_FALSE(is_present(*message, *direct, payload));
  EXPECT_TRUE(is_present(*message, *always, payload));
  EXPECT_FALSE(is_present(*message, *direct, {}));
}

TEST(Dbc, ExtendedMultiplexingFollowsRangesThroughAllLevels) {
  const Dbc dbc = parse(std::string(kMultiplexed) +
                        "SG_MUL_VAL_ 100 Inner Selector 0-1, 5-6;\n"
                        "SG_MUL_VAL_ 100 Nested Inner 7-9;\n");
  const auto [message, nested] = dbc.signal("MUX.Nested");
  const auto present = [&, m = message, n = nested](std::uint8_t selector, std::uint8_t inner) {
    const std::array<std::uint8_t, 8> payload{selector, inner};
    return is_present(*m, *n, payload);
  };
  EXPECT_TRUE(present(0, 7));
  EXPECT_TRUE(present(6, 9));
  EXPECT_FALSE(present(6, 10));
  EXPECT_FALSE(present(3, 7)) << "the inner multiplexor itself is absent";
}

TEST(Dbc, ReadsFloatTypes) {
  const Dbc dbc = parse(
      "BO_ 1 M: 12 A\n SG_ F : 0|32@1- (1,0) [0|0] \"\" B\n SG_ D : 32|64@1- (1,0) [0|0] \"\" B\n"
      "SIG_VALTYPE_ 1 F : 1;\nSIG_VALTYPE_ 1 D 2 ;\n");
  EXPECT_EQ(dbc.signal("M.F").signal->coding.value_type, ValueType::kFloat32);
  EXPECT_EQ(dbc.signal("M.D").signal->coding.value_type, ValueType::kFloat64);
}

struct BadFile {
  const char* text;
  const char* message;
};

class DbcErrors : public ::testing::TestWithParam<BadFile> {};

TEST_P(DbcErrors, NameFileAndLine) {
  EXPECT_THAT([] { (void)parse(GetParam().text); },
              ThrowsMessage<std::runtime_error>(StartsWith(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(
    All, DbcErrors,
    ::testing::Values(
        BadFile{"", "car.dbc:1: no message"},
        BadFile{"camera:\n  width: 3\n", "car.dbc:1: unknown DBC statement 'camera'"},
        BadFile{"\n{}", "car.dbc:2: expected a DBC statement"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|8@1 (1,0) [0|0] \"\" B\n", "car.dbc:2: expected '+'"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|0@1+ (1,0) [0|0] \"\" B\n", "car.dbc:2: signal 'S' has"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (x,0) [0|0] \"\" B\n",
                "car.dbc:2: expected a scale"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|0] \"km\n", "car.dbc:2: the unit has no"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S q : 0|8@1+ (1,0) [0|0] \"\" B\n", "car.dbc:2: expected ':'"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S m1 : 0|8@1+ (1,0) [0|0] \"\" B\n",
                "car.dbc:2: signal 'S' is multiplexed"},
        BadFile{" SG_ S : 0|8@1+ (1,0) [0|0] \"\" B\n", "car.dbc:1: signal before"},
        BadFile{"BO_ 2048 M: 8 A\n", "car.dbc:1: message id 2048 does not fit 11 bits"},
        BadFile{"BO_ 4294967296 M: 8 A\n", "car.dbc:1: expected a message id"},
        BadFile{"BO_ 1 M: 8 A\nBO_ 1 N: 8 A\n", "car.dbc:2: message 'N' has the id of 'M'"},
        BadFile{"BO_ 1 M: 8 A\nCM_ \"no end\n\n", "car.dbc:2: statement 'CM_' has no closing"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" B\nSIG_VALTYPE_ 1 S : 1;",
                "car.dbc:3: signal 'S' is declared a float"},
        BadFile{"BO_ 1 M: 8 A\n SG_ A M : 0|8@1+ (1,0) [0|0] \"\" B\n"
                " SG_ B m0M : 8|8@1+ (1,0) [0|0] \"\" B\nSG_MUL_VAL_ 1 B A 0-0;\n"
                "SG_MUL_VAL_ 1 A B 0-0;\n",
                "car.dbc:2: the multiplexors of signal 'A' form a circle"},
        BadFile{"BO_ 1 M: 8 A\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" B\nSG_MUL_VAL_ 1 S T 0-0;",
                "car.dbc:3: message 'M' has no multiplexor 'T'"}));

TEST(Dbc, MissingFileIsNamed) {
  EXPECT_THAT([] { (void)Dbc::load("/nowhere/car.dbc"); },
              ThrowsMessage<std::runtime_error>(StartsWith("/nowhere/car.dbc: ")));
}

}  // namespace
}  // namespace topoloc::can
