// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config.hpp"

#include "topoloc/matching/features.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

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

TEST(MatchingConfig, AnExtractorMayHaveAnyNameThatIsFitForAFile) {
  MatchingConfig config;
  config.extractor = "my-model_2";
  EXPECT_NO_THROW(validate(config));
  for (const char* name : {"", "../xfeat", "My model"}) {
    config.extractor = name;
    EXPECT_THROW(validate(config), std::invalid_argument) << name;
  }
}

TEST(Models, AMissingOneIsAnErrorThatNamesTheFileAndTheCommandThatMakesIt) {
  MatchingConfig config;
  config.model_dir = "/nonexistent";
  const auto expect_error = [&](auto make, const char* file, const char* command) {
    EXPECT_THAT([&] { make(config); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr(std::string("/nonexistent/") + file), HasSubstr(command))));
  };
  expect_error(make_extractor, "xfeat_640x384_n512.onnx",
               "`tools/export_models.py --models xfeat --sizes 640x384 --features 512`");
  expect_error(make_matcher, "lighterglue_n512.onnx", "--models xfeat");
  config.extractor = "aliked-n16";
  config.matcher = "lightglue";
  config.width_px = 1248;
  config.max_features = 1024;
  expect_error(make_extractor, "aliked-n16_1248x384_n1024.onnx",
               "`tools/export_models.py --models aliked-n16 --sizes 1248x384 --features 1024`");
  expect_error(make_matcher, "lightglue-aliked_n1024.onnx", "--models aliked-n16");
}

TEST(Models, AMatcherOfOtherFeaturesIsRefused) {
  MatchingConfig config;
  config.extractor = "disk";
  EXPECT_THAT([&] { make_matcher(config); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("lighterglue"), HasSubstr("disk"), HasSubstr("'lightglue'"))));
  config.extractor = "xfeat";
  config.matcher = "lightglue";
  EXPECT_THAT([&] { make_matcher(config); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("'lighterglue'")));
}

}  // namespace
}  // namespace topoloc::matching
