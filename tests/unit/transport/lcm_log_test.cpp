// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/lcm_log.hpp"

#include "support/temporary_folder.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::transport {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::byte> payload_of(int seed) {
  std::vector<std::byte> data(static_cast<std::size_t>(3 + seed * 5));
  for (std::size_t i = 0; i < data.size(); ++i) {
    data[i] = static_cast<std::byte>(i * 37 + static_cast<std::size_t>(seed));
  }
  return data;
}

/// Four events on two channels.
std::string small_log(const testing::TemporaryFolder& folder) {
  LcmLogWriter writer(folder / "small.lcm");
  for (int i = 0; i < 4; ++i) {
    writer.write(1'000'000 + i, i % 2 == 0 ? "CAMERA" : "POSE", payload_of(i));
  }
  writer.close();
  return testing::bytes_of(folder / "small.lcm");
}

void expect_event(const LogEvent& event, int i) {
  EXPECT_EQ(event.time_us, 1'000'000 + i);
  EXPECT_EQ(event.channel, i % 2 == 0 ? "CAMERA" : "POSE");
  const auto expected = payload_of(i);
  EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), expected.begin(), expected.end()));
}

TEST(LcmLog, WhatIsWrittenIsReadBackInAnyOrder) {
  const testing::TemporaryFolder folder;
  small_log(folder);
  const LcmLogReader reader(folder / "small.lcm");
  ASSERT_EQ(reader.size(), 4U);
  for (const int i : {3, 0, 2, 1}) {
    expect_event(reader.event(static_cast<std::size_t>(i)), i);
  }
  EXPECT_THAT(reader.channels(), ElementsAre("CAMERA", "POSE"));
  EXPECT_THAT(reader.events_on("POSE"), ElementsAre(1U, 3U));
  EXPECT_TRUE(reader.events_on("LIDAR").empty());
  EXPECT_THROW((void)reader.event(4), std::out_of_range);
  EXPECT_TRUE(reader.damage().first.empty());
}

TEST(LcmLog, LcmReadsWhatWeWrite) {
  const testing::TemporaryFolder folder;
  small_log(folder);
  lcm::LogFile log((folder / "small.lcm").string(), "r");
  ASSERT_TRUE(log.good());
  for (int i = 0; i < 4; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
    expect_event({.time_us = event->timestamp,
                  .channel = event->channel,
                  .data = {static_cast<const std::byte*>(event->data),
                           static_cast<std::size_t>(event->datalen)}},
                 i);
  }
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST(LcmLog, CutOffAnywhereKeepsTheWholeEventsAndSaysSo) {
  const testing::TemporaryFolder folder;
  const std::string whole = small_log(folder);
  std::vector<std::size_t> ends;  // of the events
  std::size_t end_of_event = 0;
  for (int i = 0; i < 4; ++i) {
    end_of_event += 28 + (i % 2 == 0 ? 6U : 4U) + payload_of(i).size();
    ends.push_back(end_of_event);
  }
  ASSERT_EQ(ends.back(), whole.size());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto file = folder.with("cut.lcm", whole.substr(0, size));
    const auto sound = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= size; }));
    if (sound == 0) {
      EXPECT_THROW(LcmLogReader{file}, std::runtime_error) << size;
      continue;
    }
    const LcmLogReader reader(file);
    ASSERT_EQ(reader.size(), sound) << size;
    expect_event(reader.event(sound - 1), static_cast<int>(sound - 1));
    const bool clean = size == ends[sound - 1];
    EXPECT_EQ(reader.damage().truncated, !clean) << size;
    EXPECT_EQ(reader.damage().skipped_bytes, size - ends[sound - 1]);
    EXPECT_EQ(reader.damage().first.empty(), clean);
  }
}

TEST(LcmLog, FindsTheNextEventBehindACorruptOne) {
  const testing::TemporaryFolder folder;
  std::string log = small_log(folder);
  const std::size_t second = 28 + 6 + payload_of(0).size();
  log[second] = 'x';
  const LcmLogReader reader(folder.with("bad.lcm", log));
  EXPECT_EQ(reader.size(), 3U);
  EXPECT_EQ(reader.damage().corrupt_regions, 1U);
  EXPECT_FALSE(reader.damage().truncated);
  EXPECT_EQ(reader.damage().skipped_bytes, 28 + 4 + payload_of(1).size());
  EXPECT_THAT(reader.damage().first, HasSubstr("bad.lcm: byte " + std::to_string(second)));
}

TEST(LcmLog, HugeLengthsAreNotBelieved) {
  const testing::TemporaryFolder folder;
  const std::string log = small_log(folder);
  for (const std::size_t field : {std::size_t{20}, std::size_t{24}}) {
    for (const char high : {'\x7F', '\xFF'}) {
      std::string damaged = log;
      damaged[field] = high;
      EXPECT_EQ(LcmLogReader(folder.with("huge.lcm", damaged)).size(), 3U);
    }
  }
}

TEST(LcmLog, OtherFilesAreErrors) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(LcmLogReader("/nowhere/camera.lcm"), std::runtime_error);
  EXPECT_THROW(LcmLogReader("/tmp"), std::runtime_error);
  EXPECT_THROW(LcmLogReader(folder.with("empty.lcm", "")), std::runtime_error);
  EXPECT_THROW(LcmLogReader(folder.with("text.lcm", "not a log at all, by far")),
               std::runtime_error);
  EXPECT_THROW(LcmLogWriter("/nowhere/camera.lcm"), std::runtime_error);
}

TEST(LcmLog, WriterRefusesWhatLcmCannotHold) {
  const testing::TemporaryFolder folder;
  LcmLogWriter writer(folder / "log.lcm");
  EXPECT_THROW(writer.write(0, "", {}), std::invalid_argument);
  EXPECT_THROW(writer.write(0, std::string(64, 'C'), {}), std::invalid_argument);
  writer.write(0, std::string(63, 'C'), {});
  writer.close();
  EXPECT_EQ(LcmLogReader(folder / "log.lcm").event(0).data.size(), 0U);
}

}  // namespace
}  // namespace topoloc::transport
