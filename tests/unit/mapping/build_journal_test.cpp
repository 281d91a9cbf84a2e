// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/build_journal.hpp"

#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"

#include "support/temporary_folder.hpp"
#include "unit/mapping/synthetic_cloud.hpp"

#include <fstream>
#include <iterator>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

map::MapInfo info() {
  map::MapInfo info;
  info.camera = kCamera;
  info.model = {.name = "made-up", .fingerprint = 42, .descriptor_dim = 4};
  return info;
}

NodeOutcome finished_node() {
  map::NodeDraft draft;
  draft.time_ns = 1'700'000'000'123'456'789;
  draft.T_world_cam.p = {1.0, 2.0, 3.0};
  draft.covariance.diagonal().setConstant(1e-4);
  for (int i = 0; i < 3; ++i) {
    // Values that the file's fixed-point numbers cannot hold exactly.
    draft.features.push_back({{10.1F + 20.3F * static_cast<float>(i), 33.3F}, 7.77F, 0.123F, 0.3F});
  }
  draft.descriptors = {1, -2, 3, -4, 5, -6, 7, -8, 9, -10, 11, -12};
  draft.camera_image = {std::byte{0xFF}, std::byte{0xD8}, std::byte{0xFF}, std::byte{0xE0}};
  draft.depth_image = map::encode_depth(
      std::vector<float>(static_cast<std::size_t>(kCamera.width_px * kCamera.height_px), 7.5F),
      kCamera.width_px, kCamera.height_px);
  draft.intensity_image = map::encode_intensity(
      std::vector<std::uint8_t>(static_cast<std::size_t>(kCamera.width_px * kCamera.height_px), 77),
      kCamera.width_px, kCamera.height_px);
  return {std::nullopt, draft, {{"coverage", 1.0 / 3.0}, {"lifted", 3.0}}};
}

class BuildJournalTest : public ::testing::Test {
 protected:
  [[nodiscard]] BuildJournal open(const std::string& settings = "every 5 m\n") const {
    return {folder_, settings, info()};
  }
  /// The file that frame 7 is stored in.
  [[nodiscard]] std::filesystem::path node_file() const { return folder_ / "frame_00000007.tmap"; }

  testing::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_ / "map.tmap.partial";
};

TEST_F(BuildJournalTest, HoldsNothingAtFirst) {
  const BuildJournal journal = open();
  EXPECT_FALSE(journal.contains(0));
  EXPECT_THROW((void)journal.load(0), std::runtime_error);
}

TEST_F(BuildJournalTest, GivesANodeBackAfterReopening) {
  const NodeOutcome stored = finished_node();
  open().store(7, stored);
  const BuildJournal journal = open();
  ASSERT_TRUE(journal.contains(7));
  EXPECT_FALSE(journal.contains(8));
  const NodeOutcome loaded = journal.load(7);
  ASSERT_FALSE(loaded.rejected.has_value());
  EXPECT_EQ(loaded.draft.time_ns, stored.draft.time_ns);
  EXPECT_EQ(loaded.draft.T_world_cam.p, stored.draft.T_world_cam.p);
  EXPECT_EQ(loaded.draft.descriptors, stored.draft.descriptors);
  EXPECT_EQ(loaded.draft.camera_image, stored.draft.camera_image);
  EXPECT_EQ(loaded.draft.depth_image, stored.draft.depth_image);
  EXPECT_FALSE(loaded.draft.intensity_image.empty());
  EXPECT_EQ(loaded.draft.intensity_image, stored.draft.intensity_image);
  EXPECT_EQ(loaded.figures, stored.figures);
  ASSERT_EQ(loaded.draft.features.size(), 3U);
  EXPECT_NEAR(loaded.draft.features[2].pixel_px.x(), 50.7F, 1.0F / 32.0F);
}

TEST_F(BuildJournalTest, StoringALoadedNodeChangesNoByte) {
  const BuildJournal journal = open();
  journal.store(7, finished_node());
  const std::string first = testing::bytes_of(node_file());
  journal.store(7, journal.load(7));
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(testing::bytes_of(node_file()), first);
}

TEST_F(BuildJournalTest, RemembersWhyANodeWasRejected) {
  const BuildJournal journal = open();
  std::size_t frame = 0;
  for (const NodeReject reason : kNodeRejects) {
    const Figures figures{{"coverage", 0.1 * static_cast<double>(++frame)}};
    journal.store(frame, {reason, {}, figures});
    ASSERT_TRUE(journal.contains(frame));
    EXPECT_EQ(journal.load(frame).rejected, reason);
    EXPECT_EQ(journal.load(frame).figures, figures);
  }
}

TEST_F(BuildJournalTest, DamagedNodeIsNotContained) {
  const BuildJournal journal = open();
  journal.store(7, finished_node());
  std::string bytes = testing::bytes_of(node_file());
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  std::ofstream(node_file(), std::ios::binary) << bytes;
  EXPECT_FALSE(journal.contains(7));

  journal.store(7, finished_node());
  ASSERT_TRUE(journal.contains(7));
  std::filesystem::resize_file(node_file(), std::filesystem::file_size(node_file()) / 2);
  EXPECT_FALSE(journal.contains(7));
}

TEST_F(BuildJournalTest, OtherSettingsThrowTheNodesAway) {
  open("every 5 m\n").store(7, finished_node());
  EXPECT_FALSE(open("every 4 m\n").contains(7));
  EXPECT_FALSE(open("every 5 m\n").contains(7));  // gone for good
}

TEST_F(BuildJournalTest, NeverDeletesAFolderThatIsNotItsOwn) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "holiday.txt") << "photos";
  EXPECT_THAT([&] { (void)open(); }, ThrowsMessage<std::runtime_error>(HasSubstr("is in the way")));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "holiday.txt"));
}

TEST_F(BuildJournalTest, RemoveLeavesNothing) {
  const BuildJournal journal = open();
  journal.store(7, finished_node());
  journal.remove();
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

}  // namespace
}  // namespace topoloc::mapping
