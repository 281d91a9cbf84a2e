// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/relocated.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::config {
namespace {

constexpr auto kPaths = R"(format: 1
can:
  dbc: [car.dbc, 'sub folder/imu.dbc']  # two buses
camera: {calibration: "camchain.yaml", mask: /elsewhere/mask.png}
imu:
  calibration: ../imu.yaml   # of the box
name: car.dbc
)";

TEST(Relocated, PathsNameTheSameFilesFromTheNewFolder) {
  EXPECT_EQ(relocated(kPaths, "/nowhere/drives/monday", "/nowhere/calibrated"), R"(format: 1
can:
  dbc: ["../drives/monday/car.dbc", "../drives/monday/sub folder/imu.dbc"]  # two buses
camera: {calibration: "../drives/monday/camchain.yaml", mask: /elsewhere/mask.png}
imu:
  calibration: "../drives/imu.yaml"   # of the box
name: car.dbc
)");
}

TEST(Relocated, PathsOfABlockListAndAModelFolderAreFound) {
  EXPECT_EQ(relocated("can:\n  dbc:\n    - a.dbc\n    - b.dbc\nmatching:\n  model_dir: models\n",
                      "/nowhere/a", "/nowhere/b"),
            "can:\n  dbc:\n    - \"../a/a.dbc\"\n    - \"../a/b.dbc\"\nmatching:\n"
            "  model_dir: \"../a/models\"\n");
}

TEST(Relocated, PathsAreAbsoluteWithoutACommonFolder) {
  EXPECT_EQ(relocated("imu: {calibration: imu.yaml}\n", "/nowhere/drive", "/elsewhere"),
            "imu: {calibration: \"/nowhere/drive/imu.yaml\"}\n");
}

TEST(Relocated, TextStaysInItsFolder) {
  EXPECT_EQ(relocated(kPaths, "/nowhere/drive", "/nowhere/sub/../drive"), kPaths);
  EXPECT_EQ(relocated("", "/nowhere/a", "/nowhere/b"), "");
}

TEST(Relocated, TextBeforeAPathMayBeOtherThanAscii) {
  EXPECT_EQ(relocated("# Straße\r\nimu: {calibration: ä.yaml}\r\n", "/nowhere/a", "/nowhere/b"),
            "# Straße\r\nimu: {calibration: \"../a/ä.yaml\"}\r\n");
}

TEST(Relocated, PathThatIsNotWrittenAsItReadsIsRefused) {
  EXPECT_THROW(relocated("imu: {calibration: \"i\\x6du.yaml\"}\n", "/nowhere/a", "/nowhere/b"),
               std::runtime_error);
  EXPECT_THROW(relocated("imu:\n  calibration: imu\n    of box.yaml\n", "/nowhere/a", "/nowhere/b"),
               std::runtime_error);
}

}  // namespace
}  // namespace topoloc::config
