// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/candump.hpp"

#include "support/temporary_folder.hpp"

#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Frame parsed(std::string_view line) {
  Frame frame;
  EXPECT_EQ(parse_candump_line(line, frame), CandumpError::kNone) << line;
  return frame;
}

TEST(CandumpLine, ReadsClassicFrame) {
  const Frame frame = parsed("(1533226488.434432) can0 260#08FFfb0000001884");
  EXPECT_EQ(frame.time_ns, 1533226488434432000);
  EXPECT_EQ(frame.interface(), "can0");
  EXPECT_EQ(frame.id, 0x260U);
  EXPECT_FALSE(frame.extended);
  EXPECT_EQ(frame.length, 8);
  EXPECT_EQ(frame.data[2], 0xFB);
  EXPECT_EQ(frame.data[7], 0x84);
}

TEST(CandumpLine, ReadsOtherKindsOfFrames) {
  EXPECT_TRUE(parsed("(1.0) vcan0 000000A5#11").extended);
  EXPECT_EQ(parsed("(1.0) vcan0 1FFFFFFF#").id, 0x1FFFFFFFU);

  const Frame remote = parsed("(1.0) can0 123#R5");
  EXPECT_EQ(remote.kind, FrameKind::kRemote);
  EXPECT_EQ(remote.length, 5);
  EXPECT_EQ(parsed("(1.0) can0 123#R").length, 0);

  const Frame error = parsed("(1.0) can0 20000004#0004000000000000");
  EXPECT_EQ(error.kind, FrameKind::kError);
  EXPECT_EQ(error.id, 4U);

  const Frame fd = parsed("(1.0) can0 123##3" + std::string(128, 'A'));
  EXPECT_TRUE(fd.fd);
  EXPECT_EQ(fd.fd_flags, 3);
  EXPECT_EQ(fd.length, 64);
  EXPECT_EQ(parsed("(1.0) can0 123##0").length, 0);
  EXPECT_EQ(parsed("(1.0) can0 123#1122334455667788_A").length, 8);
}

TEST(CandumpLine, KeepsEveryDigitOfTheTime) {
  EXPECT_EQ(parsed("(1790000000.123456789) can0 1A0#").time_ns, 1790000000123456789);
  EXPECT_EQ(parsed("(0.000001) can0 1A0#").time_ns, 1000);
  EXPECT_EQ(parsed("(0000000012.5) can0 1A0#").time_ns, 12500000000);
}

TEST(CandumpLine, AcceptsDirectionColumn) {
  EXPECT_EQ(parsed("(1.0) can0 123#11 R").length, 1);
  EXPECT_EQ(parsed("(1.0) can0 123#11 T").length, 1);
}

TEST(CandumpLine, NamesWhatIsWrong) {
  const auto error = [](std::string_view line) {
    Frame frame;
    return parse_candump_line(line, frame);
  };
  for (const char* line :
       {"", "1.0 can0 123#", "() can0 123#", "(1) can0 123#", "(1.) can0 123#", "(.5) can0 123#",
        "(-1.5) can0 123#", "(1.0000000001) can0 123#", "(99999999999.0) can0 123#", "(1.0",
        "(1.x) can0 123#", "(99999999999999999999.0) can0 123#"}) {
    EXPECT_EQ(error(line), CandumpError::kTime) << line;
  }
  EXPECT_EQ(error("(1.0)"), CandumpError::kInterface);
  EXPECT_EQ(error("(1.0) a_name_beyond_linux 123#"), CandumpError::kInterface);
  EXPECT_EQ(error(std::string_view("(1.0) can\0 123#", 15)), CandumpError::kInterface);
  for (const char* line :
       {"(1.0) can0", "(1.0) can0 123", "(1.0) can0 12#", "(1.0) can0 800#", "(1.0) can0 1234#",
        "(1.0) can0 12G#", "(1.0) can0 -12#", "(1.0) can0 80000001#", "(1.0) can0 #11"}) {
    EXPECT_EQ(error(line), CandumpError::kId) << line;
  }
  for (const char* line :
       {"(1.0) can0 123#1", "(1.0) can0 123#GG", "(1.0) can0 123#112233445566778899",
        "(1.0) can0 123##", "(1.0) can0 123##G00", "(1.0) can0 123#R9", "(1.0) can0 123#R12",
        "(1.0) can0 123#11_"}) {
    EXPECT_EQ(error(line), CandumpError::kData) << line;
  }
  EXPECT_EQ(error("(1.0) can0 123##0" + std::string(130, '0')), CandumpError::kData);
  EXPECT_EQ(error("(1.0) can0 123#11 X"), CandumpError::kTrailing);
  EXPECT_EQ(error("(1.0) can0 123#11 R R"), CandumpError::kTrailing);
}

TEST(CandumpLine, WritesWhatCanplayerReads) {
  const std::string line = "(0000000012.000034) can0 0A5#DEADBEEF";
  EXPECT_EQ(format_candump_line(parsed(line)), line);
  EXPECT_EQ(format_candump_line(parsed("(1.000000001) can0 0A5#")),
            "(0000000001.000000001) can0 0A5#");
}

Frame random_frame(std::mt19937& random) {
  Frame frame;
  frame.time_ns = static_cast<std::int64_t>(random()) * 1'000'003;
  frame.set_interface(random() % 2 == 0 ? "can0" : "a_long_iface_nm");
  frame.extended = random() % 2 == 0;
  frame.id = static_cast<std::uint32_t>(random() & (frame.extended ? 0x1FFFFFFFU : 0x7FFU));
  frame.fd = random() % 3 == 0;
  frame.fd_flags = frame.fd ? static_cast<std::uint8_t>(random() % 4) : std::uint8_t{0};
  frame.length = static_cast<std::uint8_t>(random() % (frame.fd ? 65 : 9));
  if (!frame.fd && random() % 4 == 0) {
    frame.kind = random() % 2 == 0 ? FrameKind::kRemote : FrameKind::kError;
    frame.extended = frame.kind == FrameKind::kRemote && frame.extended;
    frame.id &= 0x7FF;
  }
  for (std::size_t i = 0; frame.kind != FrameKind::kRemote && i < frame.length; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(random());
  }
  return frame;
}

TEST(CandumpLog, WhatIsWrittenIsReadBack) {
  const testing::TemporaryFolder folder;
  std::mt19937 random(3);
  std::vector<Frame> frames;
  CandumpWriter writer(folder / "can.log");
  for (int i = 0; i < 20'000; ++i) {
    frames.push_back(random_frame(random));
    writer.write(frames.back());
  }
  writer.close();
  CandumpReader reader(folder / "can.log");
  Frame frame;
  for (const Frame& expected : frames) {
    ASSERT_TRUE(reader.next(frame));
    ASSERT_EQ(frame, expected) << format_candump_line(expected);
  }
  EXPECT_FALSE(reader.next(frame));
  EXPECT_EQ(reader.frame_count(), frames.size());
  EXPECT_EQ(reader.malformed_count(), 0U);
}

TEST(CandumpLog, CountsMalformedLinesAndNamesTheFirst) {
  const testing::TemporaryFolder folder;
  const auto file = folder.with("can.log",
                                "(1.0) can0 123#11\r\n\r\n(2.0) can0 123#1\n(3.0) can0 12#11\n"
                                "(4.0) can0 123#1G\n(5.0) can0 123#22");
  CandumpReader reader(file);
  Frame frame;
  ASSERT_TRUE(reader.next(frame));
  ASSERT_TRUE(reader.next(frame));
  EXPECT_EQ(frame.data[0], 0x22) << "the last line needs no line end";
  EXPECT_FALSE(reader.next(frame));
  EXPECT_EQ(reader.malformed_count(), 3U);
  EXPECT_EQ(reader.malformed_count(CandumpError::kData), 2U);
  EXPECT_EQ(reader.malformed_count(CandumpError::kId), 1U);
  EXPECT_THAT(reader.first_error(), HasSubstr("can.log:3: bad data in '(2.0) can0 123#1'"));
}

TEST(CandumpLog, FileWithoutAnyFrameIsAnError) {
  const testing::TemporaryFolder folder;
  CandumpReader reader(folder.with("a.yaml", "camera:\n  width: 1\n"));
  Frame frame;
  EXPECT_THAT([&] { reader.next(frame); },
              ThrowsMessage<std::runtime_error>(HasSubstr("a.yaml:1: bad time")));
  CandumpReader binary(folder.with("b.bin", std::string(300'000, '\xEA')));
  EXPECT_THROW(binary.next(frame), std::runtime_error);
}

TEST(CandumpLog, MissingFileAndFolderAreErrors) {
  EXPECT_THROW(CandumpReader("/nowhere/can.log"), std::runtime_error);
  EXPECT_THROW(CandumpReader("/tmp"), std::runtime_error);
  EXPECT_THROW(CandumpWriter("/nowhere/can.log"), std::runtime_error);
}

TEST(CandumpLog, FullDiskIsAnErrorAtClose) {
  if (!std::filesystem::exists("/dev/full")) {
    GTEST_SKIP() << "no /dev/full here";
  }
  CandumpWriter writer("/dev/full");
  writer.write(parsed("(1.0) can0 123#11"));
  EXPECT_THROW(writer.close(), std::runtime_error);
}

}  // namespace
}  // namespace topoloc::can
