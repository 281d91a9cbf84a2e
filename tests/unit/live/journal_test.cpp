// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/journal.hpp"

#include "support/temporary_folder.hpp"

#include <filesystem>
#include <optional>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

/// Numbers without a short decimal form.
class Random {
 public:
  template <typename Matrix>
  void fill(Matrix& m) {
    for (double& v : m.reshaped()) {
      v = distribution_(engine_);
    }
  }
  double operator()() { return distribution_(engine_); }

 private:
  std::mt19937_64 engine_{1};
  std::uniform_real_distribution<double> distribution_{-100.0, 100.0};
};

TickInput made_up_tick(Random& random, std::uint64_t number) {
  TickInput tick;
  tick.tick = number;
  tick.now_ns = 1'700'000'000'123'456'789 + static_cast<std::int64_t>(number) * 5'000'000;
  tick.system_offset_ns = -17;
  tick.imu_count = number % 4;
  for (std::size_t i = 0; i < tick.imu_count; ++i) {
    tick.imu[i].time_ns = tick.now_ns - static_cast<std::int64_t>(i);
    random.fill(tick.imu[i].specific_force_mps2);
    random.fill(tick.imu[i].angular_rate_radps);
  }
  tick.speed_count = number % 3;
  for (std::size_t i = 0; i < tick.speed_count; ++i) {
    tick.speed[i] = {tick.now_ns + static_cast<std::int64_t>(i), random()};
  }
  if (number == 2) {
    estimation::InitialPose& pose = tick.initial_pose.emplace();
    pose.time_ns = tick.now_ns;
    random.fill(pose.T_world_imu.R);
    random.fill(pose.T_world_imu.p);
  }
  return tick;
}

NumberedMatchSet made_up_set(Random& random, std::uint64_t number) {
  NumberedMatchSet set;
  set.number = number;
  set.set.frame_time_ns = 1'700'000'000'000'000'001;
  set.set.node_count = 2;
  for (int i = 0; i < 2; ++i) {
    estimation::MatchedNode& node = set.set.nodes[static_cast<std::size_t>(i)];
    node.node_id = static_cast<std::uint32_t>(i + 4'000'000'000U);
    random.fill(node.R_world_cam);
    random.fill(node.p_world_cam);
    random.fill(node.covariance);
  }
  set.set.match_count = 300;
  for (int i = 0; i < 300; ++i) {
    estimation::MapMatch& match = set.set.matches[static_cast<std::size_t>(i)];
    random.fill(match.pixel_px);
    random.fill(match.p_world_m);
    match.pixel_std_px = random();
    match.node_slot = i % 2;
  }
  return set;
}

void expect_same(const TickInput& a, const TickInput& b) {
  EXPECT_EQ(a.tick, b.tick);
  EXPECT_EQ(a.now_ns, b.now_ns);
  EXPECT_EQ(a.system_offset_ns, b.system_offset_ns);
  ASSERT_EQ(a.imu_count, b.imu_count);
  for (std::size_t i = 0; i < a.imu_count; ++i) {
    EXPECT_EQ(a.imu[i].time_ns, b.imu[i].time_ns);
    EXPECT_EQ(a.imu[i].specific_force_mps2, b.imu[i].specific_force_mps2);
    EXPECT_EQ(a.imu[i].angular_rate_radps, b.imu[i].angular_rate_radps);
  }
  ASSERT_EQ(a.speed_count, b.speed_count);
  for (std::size_t i = 0; i < a.speed_count; ++i) {
    EXPECT_EQ(a.speed[i].time_ns, b.speed[i].time_ns);
    EXPECT_EQ(a.speed[i].speed_mps, b.speed[i].speed_mps);
  }
  EXPECT_EQ(a.match_set, b.match_set);
  ASSERT_EQ(a.initial_pose.has_value(), b.initial_pose.has_value());
  if (a.initial_pose) {
    EXPECT_EQ(a.initial_pose->time_ns, b.initial_pose->time_ns);
    EXPECT_EQ(a.initial_pose->T_world_imu.R, b.initial_pose->T_world_imu.R);
    EXPECT_EQ(a.initial_pose->T_world_imu.p, b.initial_pose->T_world_imu.p);
  }
}

void expect_same(const estimation::MapMatchSet& a, const estimation::MapMatchSet& b) {
  EXPECT_EQ(a.frame_time_ns, b.frame_time_ns);
  ASSERT_EQ(a.node_count, b.node_count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.node_count); ++i) {
    EXPECT_EQ(a.nodes[i].node_id, b.nodes[i].node_id);
    EXPECT_EQ(a.nodes[i].R_world_cam, b.nodes[i].R_world_cam);
    EXPECT_EQ(a.nodes[i].p_world_cam, b.nodes[i].p_world_cam);
    EXPECT_EQ(a.nodes[i].covariance, b.nodes[i].covariance);
  }
  ASSERT_EQ(a.match_count, b.match_count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.match_count); ++i) {
    EXPECT_EQ(a.matches[i].pixel_px, b.matches[i].pixel_px);
    EXPECT_EQ(a.matches[i].p_world_m, b.matches[i].p_world_m);
    EXPECT_EQ(a.matches[i].pixel_std_px, b.matches[i].pixel_std_px);
    EXPECT_EQ(a.matches[i].node_slot, b.matches[i].node_slot);
  }
}

struct ReadTick {
  TickInput tick;
  std::optional<estimation::MapMatchSet> set;
};

JournalSummary read_all(const std::filesystem::path& folder, std::vector<ReadTick>& ticks) {
  return read_journal(
      folder, {.file = {}, .tick = [&](const TickInput& tick, const estimation::MapMatchSet* set) {
                 ticks.push_back({tick, set != nullptr ? std::optional(*set) : std::nullopt});
               }});
}

TEST(Journal, ReadsWhatWasWrittenBitForBit) {
  const TemporaryFolder folder;
  Random random;
  std::vector<TickInput> ticks;
  const NumberedMatchSet set = made_up_set(random, 7);
  {
    JournalWriter journal(folder / "flight", 1 << 24, {"1.2", "format: 1\n"});
    for (std::uint64_t i = 0; i < 20; ++i) {
      ticks.push_back(made_up_tick(random, i));
      if (i == 11) {
        journal.add(set);
        ticks.back().match_set = 7;
      }
      journal.add(ticks.back());
    }
    journal.close();
  }
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_TRUE(summary.is_whole());
  EXPECT_EQ(summary.vehicle_yaml, "format: 1\n");
  ASSERT_EQ(read.size(), ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    expect_same(read[i].tick, ticks[i]);
    ASSERT_EQ(read[i].set.has_value(), i == 11);
  }
  expect_same(*read[11].set, set.set);
}

TEST(Journal, StaysWithinItsSizeAndSaysWhatIsMissing) {
  const TemporaryFolder folder;
  Random random;
  constexpr std::size_t kBytes = 200'000;
  {
    JournalWriter journal(folder / "flight", kBytes, {"1.2", ""});
    for (std::uint64_t i = 0; i < 4000; ++i) {
      journal.add(made_up_tick(random, i));
    }
    journal.close();
  }
  std::size_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "flight")) {
    bytes += entry.file_size();
  }
  EXPECT_LE(bytes, kBytes + kBytes / 8);
  EXPECT_GE(bytes, kBytes / 2);
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_FALSE(summary.from_start);
  EXPECT_GT(read.front().tick.tick, 0U);
  EXPECT_EQ(read.back().tick.tick, 3999U);
  EXPECT_EQ(summary.ticks, 4000U - read.front().tick.tick);
}

TEST(Journal, IsReadUpToWhereThePowerFailed) {
  const TemporaryFolder folder;
  Random random;
  {
    JournalWriter journal(folder / "flight", 1 << 24, {"1.2", ""});
    for (std::uint64_t i = 0; i < 20; ++i) {
      journal.add(made_up_tick(random, i));
    }
    journal.close();
  }
  const auto file = folder / "flight" / "journal_000001.lcm";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 10);
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_EQ(summary.ticks, 19U);
  EXPECT_EQ(summary.unreadable, 1U);
  EXPECT_FALSE(summary.other_version);
  EXPECT_FALSE(summary.is_whole());
}

/// Small files: some hundred ticks make several.
void write_ticks(const std::filesystem::path& folder, std::uint64_t count) {
  Random random;
  JournalWriter journal(folder, 8 * 10'000, {"1.2", "format: 1\n"});
  for (std::uint64_t i = 0; i < count; ++i) {
    journal.add(made_up_tick(random, i));
  }
  journal.close();
}

TEST(Journal, IsReadAlthoughAFileHasNothingInIt) {
  const TemporaryFolder folder;
  write_ticks(folder / "flight", 200);
  const std::vector<std::filesystem::path> files = journal_files(folder / "flight");
  ASSERT_GE(files.size(), 5U);
  std::filesystem::resize_file(files.back(), 0);
  std::filesystem::resize_file(files[2], 20);  // in its first event
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_EQ(summary.unreadable, 2U);
  EXPECT_FALSE(summary.is_whole());
  EXPECT_GT(summary.ticks, 50U);
  EXPECT_EQ(summary.vehicle_yaml, "format: 1\n");
}

TEST(Journal, OfWhichFilesAreMissingInTheMiddleIsNotWhole) {
  const TemporaryFolder folder;
  write_ticks(folder / "flight", 200);
  const std::vector<std::filesystem::path> files = journal_files(folder / "flight");
  ASSERT_GE(files.size(), 5U);
  std::filesystem::remove(files[2]);
  std::filesystem::remove(files[3]);
  std::vector<bool> after_gap;
  const JournalSummary summary = read_journal(
      folder / "flight",
      {.file = [&](const JournalFileStart& file) { after_gap.push_back(file.after_gap); },
       .tick = [](const TickInput&, const estimation::MapMatchSet*) {}});
  EXPECT_TRUE(summary.from_start);
  EXPECT_EQ(summary.missing_files, 2U);
  EXPECT_FALSE(summary.is_whole());
  ASSERT_GE(after_gap.size(), 3U);
  EXPECT_FALSE(after_gap[1]);
  EXPECT_TRUE(after_gap[2]);
}

TEST(Journal, OfAnotherVersionIsReadAsFarAsItCanBe) {
  const TemporaryFolder folder;
  write_ticks(folder / "flight", 5);
  const std::filesystem::path file = folder / "flight" / "journal_000001.lcm";
  std::string bytes = testing::bytes_of(file);
  const std::string start = "JOURNAL_START";
  bytes.at(bytes.find(start) + start.size()) ^= 1;  // the fingerprint of the message's type
  (void)folder.with("flight/journal_000001.lcm", bytes);
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_TRUE(summary.other_version);
  EXPECT_FALSE(summary.is_whole());
  EXPECT_EQ(summary.ticks, 5U);
}

TEST(Journal, HasAGapBehindAFileThatEndsEarly) {
  const TemporaryFolder folder;
  write_ticks(folder / "flight", 200);
  const std::vector<std::filesystem::path> files = journal_files(folder / "flight");
  std::filesystem::resize_file(files[1], std::filesystem::file_size(files[1]) / 2);
  std::vector<bool> after_gap;
  const JournalSummary summary = read_journal(
      folder / "flight",
      {.file = [&](const JournalFileStart& file) { after_gap.push_back(file.after_gap); },
       .tick = [](const TickInput&, const estimation::MapMatchSet*) {}});
  EXPECT_FALSE(summary.is_whole());
  ASSERT_EQ(after_gap.size(), files.size());
  EXPECT_TRUE(after_gap[2]);
}

TEST(Journal, IsOfTheFilesWithANumberInItsOrder) {
  const TemporaryFolder folder;
  for (const char* name : {"journal_000002.lcm", "journal_1000000.lcm", "journal_999999.lcm",
                           "journal_copy.lcm", "journal_000003.lcm.part"}) {
    (void)folder.with(name, "x");
  }
  std::vector<std::string> names;
  for (const std::filesystem::path& file : journal_files(folder / ".")) {
    names.push_back(file.filename().string());
  }
  EXPECT_THAT(names, ::testing::ElementsAre("journal_000002.lcm", "journal_999999.lcm",
                                            "journal_1000000.lcm"));
}

TEST(Journal, OfWhichNoFileCanBeReadIsRefused) {
  const TemporaryFolder folder;
  write_ticks(folder / "flight", 100);
  for (const auto& file : journal_files(folder / "flight")) {
    std::filesystem::resize_file(file, 0);
  }
  std::vector<ReadTick> read;
  EXPECT_THAT([&] { read_all(folder / "flight", read); },
              ThrowsMessage<std::runtime_error>(HasSubstr("flight: no file of the journal")));
}

TEST(Journal, TellsTicksAndMatchSetsThatWereLost) {
  const TemporaryFolder folder;
  Random random;
  {
    JournalWriter journal(folder / "flight", 1 << 24, {"1.2", ""});
    TickInput tick = made_up_tick(random, 0);
    tick.match_set = 3;
    journal.add(tick);
    tick = made_up_tick(random, 5);
    tick.lost_before = 4;
    journal.add(tick);
    journal.close();
  }
  std::vector<ReadTick> read;
  const JournalSummary summary = read_all(folder / "flight", read);
  EXPECT_EQ(summary.lost_match_sets, 1U);
  EXPECT_EQ(summary.lost_ticks, 4U);
  EXPECT_FALSE(read.front().set);
}

TEST(Journal, OfTheRunBeforeIsKeptBesideThePresentOne) {
  const TemporaryFolder folder;
  Random random;
  for (std::uint64_t run = 1; run <= 3; ++run) {
    JournalWriter journal(folder / "flight", 1 << 24, {"1.2", ""});
    for (std::uint64_t i = 0; i < run; ++i) {
      journal.add(made_up_tick(random, i));
    }
    journal.close();
  }
  std::vector<ReadTick> read;
  EXPECT_EQ(read_all(folder / "flight", read).ticks, 3U);
  EXPECT_EQ(read_all(folder / "flight" / "previous", read).ticks, 2U);
}

TEST(Journal, ComplaintsNameTheFolder) {
  const TemporaryFolder folder;
  std::vector<ReadTick> read;
  EXPECT_THAT([&] { read_all(folder / "nothing", read); },
              ThrowsMessage<std::runtime_error>(HasSubstr("nothing: no journal")));
  EXPECT_THAT(
      [&] {
        JournalWriter(folder.with("file", "x") / "below", 1 << 20, {"1.2", ""});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("below: cannot be used for the journal")));
}

}  // namespace
}  // namespace topoloc::live
