// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/result_files.hpp"

#include "support/temporary_folder.hpp"

#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::localiser {
namespace {

class ResultFilesTest : public ::testing::Test {
 protected:
  static estimation::Estimate estimate(std::int64_t time_ns) {
    estimation::Estimate e;
    e.time_ns = time_ns;
    e.mode = estimation::Mode::kTracking;
    return e;
  }
  [[nodiscard]] std::set<std::string> names() const {
    std::set<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "")) {
      out.insert(entry.path().filename().string());
    }
    return out;
  }
  [[nodiscard]] std::vector<std::vector<std::string>> cells(const std::string& name) const {
    std::vector<std::vector<std::string>> out;
    std::ifstream file(folder_ / name);
    for (std::string line; std::getline(file, line);) {
      out.emplace_back(1);
      for (const char c : line) {
        if (c == ',') {
          out.back().emplace_back();
        } else {
          out.back().back() += c;
        }
      }
    }
    return out;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(ResultFilesTest, AppearWhenTheRunIsComplete) {
  {
    ResultFiles files(folder_ / "est.tum");
    files.add(estimate(1'000'000'000));
    EXPECT_FALSE(names().contains("est.tum"));
    files.finish({});
  }
  EXPECT_EQ(names(), (std::set<std::string>{"est.tum", "est.states.csv", "est.updates.csv"}));
}

TEST_F(ResultFilesTest, RunThatFailsLeavesTheLastOnesAlone) {
  {
    ResultFiles files(folder_ / "est.tum");
    files.finish({});
  }
  const auto before = std::filesystem::file_size(folder_ / "est.states.csv");
  {
    ResultFiles files(folder_ / "est.tum");
    files.add(estimate(1'000'000'000));
  }
  EXPECT_EQ(names().size(), 3U);
  EXPECT_EQ(std::filesystem::file_size(folder_ / "est.states.csv"), before);
}

TEST_F(ResultFilesTest, NamesThatDifferAfterADotStayApart) {
  ResultFiles(folder_ / "est_0.5").finish({});
  ResultFiles(folder_ / "est_0.8").finish({});
  EXPECT_EQ(names().size(), 6U);
  EXPECT_TRUE(names().contains("est_0.5.states.csv"));
}

TEST_F(ResultFilesTest, TablesHaveAsManyCellsAsColumns) {
  FrameRecord matched;
  matched.update.emplace();
  matched.update->result.information.diagonal() << 30.0, 20.0, 10.0, 3.0, 2.0, 1.0;
  ResultFiles files(folder_ / "est.tum");
  files.add(estimate(1'000'000'000));
  files.finish(std::vector<FrameRecord>{{}, matched});
  for (const char* name : {"est.states.csv", "est.updates.csv"}) {
    const auto table = cells(name);
    ASSERT_GE(table.size(), 2U);
    for (const auto& row : table) {
      EXPECT_EQ(row.size(), table.front().size()) << name;
    }
  }
  const auto updates = cells("est.updates.csv");
  ASSERT_EQ(updates.size(), 3U);
  const std::size_t last = updates[0].size() - 1;
  EXPECT_EQ(updates[0][last - 1], "min_information_rotation");
  EXPECT_EQ(updates[2][last - 1], "10");
  EXPECT_EQ(updates[2][last], "1");
}

TEST_F(ResultFilesTest, FolderThatIsNotThereIsNamed) {
  try {
    ResultFiles files(folder_ / "nowhere/est.tum");
    FAIL() << "no complaint";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("nowhere/est.tum"), std::string::npos);
  }
}

}  // namespace
}  // namespace topoloc::localiser
