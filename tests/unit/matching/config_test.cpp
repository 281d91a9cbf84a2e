// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config.hpp"

#include "topoloc/matching/features.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

TEST(MatchingConfig, NamesTheKeyThatIsOutOfRange) {
  MatchingConfig config;
  EXPECT_NO_THROW(validate(config));
  config.outliers.consensus_px = std::nan("");
  try {
    validate(config);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("outliers.consensus_px"), std::string::npos);
  }
  config = {};
  config.matcher = "magic";
  EXPECT_THROW(validate(config), std::invalid_argument);
}

TEST(Models, AMissingOneIsAnErrorThatNamesTheFile) {
  MatchingConfig config;
  config.model_dir = "/nonexistent";
  try {
    make_extractor(config);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/xfeat_640x384_n512.onnx"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace topoloc::matching
