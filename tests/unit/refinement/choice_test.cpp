// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/choice.hpp"

#include "unit/refinement/graph_drive.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

using Indices = std::vector<std::size_t>;

class Choice : public ::testing::Test {
 protected:
  [[nodiscard]] Registration of(std::size_t keyframe, double std_m, double off_m = 0.0) const {
    Registration registration = drive_.registration(keyframe, 0.003, std_m);
    registration.T_world_imu.p.y() += off_m;
    return registration;
  }
  [[nodiscard]] Indices chosen(const std::vector<Registration>& registrations) const {
    return agreeing_with_the_surest(registrations, drive_.truth);
  }

  GraphDrive drive_{20};
};

TEST_F(Choice, IsNothingOfNothing) { EXPECT_EQ(chosen({}), Indices{}); }

TEST_F(Choice, TakesTheOnlyOne) { EXPECT_EQ(chosen({of(3, 0.1)}), Indices{0}); }

TEST_F(Choice, TakesAllThatAgree) {
  EXPECT_EQ(chosen({of(8, 0.1), of(2, 0.2, 0.2), of(14, 0.3, -0.4)}), (Indices{0, 1, 2}));
}

TEST_F(Choice, TakesTheSurerOfTwoThatDisagree) {
  EXPECT_EQ(chosen({of(8, 0.05), of(10, 0.1, 1.0)}), Indices{0});
  EXPECT_EQ(chosen({of(8, 0.1), of(10, 0.05, 1.0)}), Indices{1});
}

TEST_F(Choice, DoesNotLetAViewLeadAgainstAWindow) {
  Registration match = of(10, 0.02, 1.0);
  match.route = Route::kMatches;
  EXPECT_EQ(chosen({of(8, 0.1), match}), Indices{0});
  match.T_world_imu = drive_.truth[10];
  EXPECT_EQ(chosen({of(8, 0.1), match}), (Indices{0, 1}));
}

TEST_F(Choice, LetsTheSurestLeadTheRest) {
  EXPECT_EQ(chosen({of(8, 0.1), of(4, 0.05, 1.0), of(6, 0.1, 1.1), of(7, 0.1, 0.0)}),
            (Indices{1, 2}));
}

TEST_F(Choice, CountsNeighboursThatShareTheCloudsErrorsAsOne) {
  Registration match = of(10, 0.1);
  match.route = Route::kMatches;
  std::vector<Registration> chosen{of(8, 0.1), match, match, match};
  share_errors(chosen, 5.0, 20.0);
  EXPECT_DOUBLE_EQ(chosen[0].shared_by, 4.0);  // stretches of 5 m in 20 m
  EXPECT_DOUBLE_EQ(chosen[1].shared_by, 12.0);
  EXPECT_DOUBLE_EQ(chosen[3].shared_by, 12.0);
  share_errors(chosen, 50.0, 20.0);
  EXPECT_DOUBLE_EQ(chosen[0].shared_by, 1.0);
  EXPECT_DOUBLE_EQ(chosen[1].shared_by, 3.0);
}

}  // namespace
}  // namespace topoloc::refinement
