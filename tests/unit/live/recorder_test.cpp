// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/recorder.hpp"

#include "live/stop_event.hpp"
#include "support/temporary_folder.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

class RecorderTest : public ::testing::Test {
 protected:
  Recorder make(const std::filesystem::path& folder) {
    return {{.folder = folder, .max_bytes = 1 << 20, .origin = {}}, match_sets_, ticks_};
  }

  testing::TemporaryFolder folder_;
  realtime::SpscRing<NumberedMatchSet> match_sets_{4};
  realtime::SpscRing<RecordedTick> ticks_{4};
  StopEvent stop_;
};

TEST_F(RecorderTest, ThatCannotOpenItsJournalSaysSoAndDoesNothing) {
  Recorder recorder = make(folder_.with("file", "x") / "below");
  EXPECT_THAT(recorder.open(), ::testing::HasSubstr("below: cannot be used for the journal"));
  EXPECT_TRUE(recorder.failed());
  recorder.run(stop_);  // ends
}

TEST_F(RecorderTest, LeavesTheJournalBeforeWhereItIsUntilItOpens) {
  const std::filesystem::path flight = folder_ / "flight";
  {
    JournalWriter journal(flight, 1 << 20, {});
    journal.close();
  }
  Recorder recorder = make(flight);
  EXPECT_FALSE(std::filesystem::exists(flight / "previous"));
  EXPECT_EQ(recorder.open(), "");
  EXPECT_EQ(journal_files(flight / "previous").size(), 1U);
  EXPECT_FALSE(recorder.failed());
  stop_.set();
  recorder.run(stop_);
}

}  // namespace
}  // namespace topoloc::live
