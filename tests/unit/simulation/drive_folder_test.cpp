// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_folder.hpp"

#include "topoloc/config/config_error.hpp"
#include "topoloc/simulation/world_file.hpp"

#include "support/temporary_folder.hpp"

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

namespace fs = std::filesystem;
using topoloc::testing::bytes_of;
using topoloc::testing::TemporaryFolder;

void fill(const fs::path& folder, const std::string& text) {
  std::ofstream(folder / "vehicle.yaml") << text;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  return names;
}

TEST(DriveFolder, IsThereWhenItIsComplete) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "drives/new";
  create_folder(out, false, [&](const fs::path& folder) {
    EXPECT_FALSE(fs::exists(out));
    fill(folder, "one");
  });
  EXPECT_EQ(bytes_of(out / "vehicle.yaml"), "one");
  EXPECT_EQ(names_in(temporary / "drives"), (std::vector<std::string>{"new"}));
}

TEST(DriveFolder, LeavesNothingBehindWhenItFails) {
  const TemporaryFolder temporary;
  const auto failing = [](const fs::path& folder) {
    fill(folder, "half");
    throw std::runtime_error("disk full");
  };
  EXPECT_THROW(create_folder(temporary / "new", false, failing), std::runtime_error);
  EXPECT_TRUE(names_in(temporary / ".").empty());
}

TEST(DriveFolder, ThatCannotBeMadeIsNamedAsTheUserNamedIt) {
  try {
    create_folder("/proc/new", false, [](const fs::path&) { FAIL(); });
    FAIL() << "no folder can be made in /proc";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::StartsWith("/proc/new: "));
    EXPECT_THAT(error.what(), ::testing::Not(::testing::HasSubstr("partial")));
  }
}

TEST(DriveFolder, LeavesAFolderOfTheUsersAloneThatIsCalledPartial) {
  const TemporaryFolder temporary;
  fs::create_directory(temporary / "new.partial");
  std::ofstream(temporary / "new.partial/letter") << "dear";
  create_folder(temporary / "new", true, [](const fs::path& folder) { fill(folder, "one"); });
  EXPECT_EQ(bytes_of(temporary / "new.partial/letter"), "dear");
  EXPECT_EQ(bytes_of(temporary / "new/vehicle.yaml"), "one");
}

TEST(DriveFolder, OfTwoRunsAtOnceTheFirstToEndIsKept) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "new";
  const auto overtaken = [&](const fs::path& folder) {
    fill(folder, "slow");
    create_folder(out, false, [](const fs::path& other) {
      EXPECT_TRUE(fs::is_empty(other));
      fill(other, "fast");
    });
    EXPECT_EQ(bytes_of(folder / "vehicle.yaml"), "slow");
  };
  EXPECT_THROW(create_folder(out, false, overtaken), std::runtime_error);
  EXPECT_EQ(bytes_of(out / "vehicle.yaml"), "fast");
  EXPECT_EQ(names_in(temporary / "."), (std::vector<std::string>{"new"}));
}

TEST(DriveFolder, IsForEverybodyWhomTheUmaskLetsIn) {
  const TemporaryFolder temporary;
  create_folder(temporary / "new", false, [](const fs::path& folder) { fill(folder, "one"); });
  fs::create_directory(temporary / "usual");
  EXPECT_EQ(fs::status(temporary / "new").permissions(),
            fs::status(temporary / "usual").permissions());
}

TEST(DriveFolder, ReplacesADriveOnlyByForceAndOnlyWhenComplete) {
  const TemporaryFolder temporary;
  const fs::path out = temporary / "drive/";
  create_folder(out, false, [](const fs::path& folder) { fill(folder, "old"); });
  EXPECT_THROW(create_folder(out, false, [](const fs::path&) {}), std::runtime_error);
  const auto failing = [](const fs::path&) { throw std::runtime_error("stopped"); };
  EXPECT_THROW(create_folder(out, true, failing), std::runtime_error);
  EXPECT_EQ(bytes_of(out / "vehicle.yaml"), "old");
  create_folder(out, true, [](const fs::path& folder) { fill(folder, "new"); });
  EXPECT_EQ(bytes_of(out / "vehicle.yaml"), "new");
}

TEST(DriveFolder, DoesNotReplaceWhatIsNoDrive) {
  const TemporaryFolder temporary;
  const fs::path file = temporary.with("letter", "dear");
  EXPECT_THROW(create_folder(file, true, [](const fs::path&) {}), std::runtime_error);
  fs::create_directory(temporary / "mine");
  std::ofstream(temporary / "mine/letter") << "dear";
  EXPECT_THROW(create_folder(temporary / "mine", true, [](const fs::path&) {}), std::runtime_error);
  EXPECT_EQ(bytes_of(temporary / "mine/letter"), "dear");
}

TEST(WorldFile, IsReadAsItWasWritten) {
  const TemporaryFolder temporary;
  const world::WorldSpec spec{
      .scenario = world::Scenario::kMixed, .seed = 18'446'744'073'709'551'615U, .length_m = 312.5};
  write_world_file(temporary / "world.yaml", spec);
  const world::WorldSpec read = read_world_file(temporary / "world.yaml");
  EXPECT_EQ(read.scenario, spec.scenario);
  EXPECT_EQ(read.seed, spec.seed);
  EXPECT_EQ(read.length_m, spec.length_m);
}

TEST(WorldFile, ComplaintsNameFileLineAndKey) {
  const TemporaryFolder temporary;
  const auto complaint = [&](const std::string& text) {
    try {
      read_world_file(temporary.with("world.yaml", text));
    } catch (const config::ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string head = "format: 1\nworld_version: " + std::to_string(kWorldVersion) + "\n";
  EXPECT_THAT(complaint(head + "scenario: moon\nseed: 1\nlength_m: 9\n"),
              ::testing::HasSubstr("world.yaml:3: scenario"));
  EXPECT_THAT(complaint(head + "scenario: town\nseed: -1\nlength_m: 9\n"),
              ::testing::HasSubstr("world.yaml:4: seed"));
  EXPECT_THAT(complaint(head + "scenario: town\nseed: 1\n"), ::testing::HasSubstr("length_m"));
  EXPECT_THAT(complaint("format: 1\nworld_version: 999\nscenario: town\nseed: 1\nlength_m: 9\n"),
              ::testing::HasSubstr("world.yaml:2: world_version"));
}

}  // namespace
}  // namespace topoloc::simulation
