// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/registration_log.hpp"

#include "support/temporary_folder.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

std::vector<std::string> written(const std::vector<RegistrationAttempt>& attempts) {
  const testing::TemporaryFolder folder;
  write_registrations(folder / "tried.csv", attempts);
  std::ifstream file(folder / "tried.csv");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
  }
  return lines;
}

TEST(RegistrationLog, HasALineForEachAttemptBelowTheNamesOfItsColumns) {
  RegistrationAttempt attempt;
  attempt.time_ns = 1'234'567'890'123'456'789;
  attempt.pass = 2;
  attempt.T_prior.p = {1.0, 2.0, 3.0};
  attempt.found.route = Route::kMatches;
  attempt.found.T_world_imu.p = {1.5, 2.0, 3.0};
  attempt.found.covariance.diagonal().setConstant(0.04);
  attempt.found.score = 0.5;
  attempt.found.significance = 6.25;
  attempt.significant = attempt.accepted = true;
  attempt.seconds = 0.125;
  RegistrationAttempt other;
  const auto lines = written({attempt, other});
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1],
            "1234567890123456789,2,matches,"
            "1.000000,2.000000,3.000000,0.000000000,0.000000000,0.000000000,1.000000000,"
            "1.500000,2.000000,3.000000,0.000000000,0.000000000,0.000000000,1.000000000,"
            "0.200000,0.200000,0.200000,0.200000,0.200000,0.200000,"
            "0.500000,6.250,1,1,0.1250");
  EXPECT_THAT(lines[2], ::testing::HasSubstr(",correlation,"));
  EXPECT_EQ(std::count(lines[0].begin(), lines[0].end(), ','),
            std::count(lines[1].begin(), lines[1].end(), ','));
}

TEST(RegistrationLog, NamesAFileThatItCannotWrite) {
  try {
    write_registrations("/nowhere/tried.csv", {});
    FAIL() << "no complaint";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("/nowhere/tried.csv"));
  }
}

}  // namespace
}  // namespace topoloc::refinement
