// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"

#include "map_fixture.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>

namespace topoloc::map::test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class MapRoundTrip : public MapTest {};

TEST_F(MapRoundTrip, KeepsTheInfo) {
  const MapInfo info = make_info();
  write_map(path(), 2, 5, info);
  const MapFile map(path());
  EXPECT_EQ(map.info().camera, info.camera);
  EXPECT_EQ(map.info().model, info.model);
  EXPECT_EQ(map.info().origin_m, info.origin_m);
  EXPECT_EQ(map.info().crs, info.crs);
  EXPECT_EQ(map.info().creator, info.creator);
  EXPECT_EQ(map.info().T_imu_cam.p, info.T_imu_cam.p);
  EXPECT_TRUE(map.info().T_imu_cam.R.isApprox(info.T_imu_cam.R, 1e-14));
}

TEST_F(MapRoundTrip, KeepsEveryNode) {
  const MapInfo info = make_info();
  write_map(path(), 7, 40, info);
  const MapFile map(path());
  ASSERT_EQ(map.node_count(), 7U);
  EXPECT_TRUE(map.has_images());
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    const NodeDraft draft = make_node(i, 40 + i, info);
    const NodeView node = map.node(i);
    EXPECT_EQ(node.id, i);
    EXPECT_EQ(node.time_ns, draft.time_ns);
    EXPECT_EQ(node.T_world_cam.p, draft.T_world_cam.p);
    EXPECT_TRUE(node.T_world_cam.R.isApprox(draft.T_world_cam.R, 1e-14));
    EXPECT_EQ(map.T_world_cam(i).p, draft.T_world_cam.p);
    EXPECT_TRUE(node.covariance.isApprox(draft.covariance, 1e-6));
    EXPECT_TRUE(std::equal(node.descriptors.begin(), node.descriptors.end(),
                           draft.descriptors.begin(), draft.descriptors.end()));
    EXPECT_TRUE(std::equal(node.camera_image.begin(), node.camera_image.end(),
                           draft.camera_image.begin(), draft.camera_image.end()));
    EXPECT_TRUE(std::equal(node.depth_image.begin(), node.depth_image.end(),
                           draft.depth_image.begin(), draft.depth_image.end()));
    EXPECT_FALSE(node.intensity_image.empty());
    EXPECT_TRUE(std::equal(node.intensity_image.begin(), node.intensity_image.end(),
                           draft.intensity_image.begin(), draft.intensity_image.end()));
    ASSERT_EQ(node.features.size(), draft.features.size());
    for (std::size_t k = 0; k < node.features.size(); ++k) {
      const Feature& expected = draft.features[k];
      EXPECT_LE((node.features[k].pixel_px() - expected.pixel_px).cwiseAbs().maxCoeff(),
                1.0F / 64.0F);
      EXPECT_EQ(node.features[k].depth_m, expected.depth_m);
    }
    EXPECT_TRUE(map.node_intact(i));
  }
}

TEST_F(MapRoundTrip, TakesQualityFromTheFeatures) {
  const MapInfo info = make_info();
  MapWriter writer(path(), info);
  NodeDraft node = make_node(0, 4, info);
  node.features[0].depth_m = 0.0F;
  node.features[1].depth_m = 0.0F;
  node.features[2].depth_m = 10.0F;
  node.features[3].depth_m = 20.0F;
  node.features[2].depth_std_m = 0.1F;
  node.features[3].depth_std_m = 0.3F;
  writer.add(node);
  writer.finish();
  const NodeQuality quality = MapFile(path()).node(0).quality;
  EXPECT_EQ(quality.feature_count, 4U);
  EXPECT_EQ(quality.lifted_count, 2U);
  EXPECT_FLOAT_EQ(quality.lifted_share(), 0.5F);
  EXPECT_NEAR(quality.mean_depth_std_m, 0.2F, 0.2F * 0.023F);
}

TEST_F(MapRoundTrip, KeepsNodesWithoutFeaturesOrImages) {
  const MapInfo info = make_info();
  MapWriter writer(path(), info);
  writer.add(make_node(0, 0, info, false));
  writer.add(make_node(1, 3, info, true));
  writer.add(make_node(2, 0, info, false));
  writer.finish();
  const MapFile map(path());
  EXPECT_EQ(map.node(0).features.size(), 0U);
  EXPECT_EQ(map.node(0).quality.lifted_share(), 0.0F);
  EXPECT_EQ(map.node(1).features.size(), 3U);
  EXPECT_EQ(map.node(1).camera_image.size(), 21U);
  EXPECT_TRUE(map.node(2).camera_image.empty());
  map.prefetch(0);
  map.prefetch(1);
  EXPECT_TRUE(verify(path()).ok());
}

TEST_F(MapRoundTrip, HasNoImageSectionsWithoutImages) {
  write_map(path(), 3, 4, make_info(), false);
  const MapFile map(path());
  EXPECT_FALSE(map.has_images());
  EXPECT_FALSE(map.has_intensity_images());
  EXPECT_EQ(map.sections().size(), 4U);
  EXPECT_TRUE(verify(path()).ok());
}

TEST_F(MapRoundTrip, KeepsTheReport) {
  const std::string report = "{\"creator\": \"caf\u00e9 \xc3\xa9\", \"nodes\": []}\n";
  MapWriter writer(path(), make_info());
  writer.add(make_node(0, 3, make_info()));
  writer.set_report(report);
  writer.finish();
  EXPECT_EQ(MapFile(path()).report(), report);
  EXPECT_TRUE(verify(path()).ok());
}

TEST_F(MapRoundTrip, WithoutIntensityAndReportIsAMapAsOlderProgramsWrite) {
  MapWriter writer(path(), make_info());
  NodeDraft node = make_node(0, 3, make_info());
  node.intensity_image.clear();
  writer.add(node);
  writer.finish();
  const MapFile map(path());
  std::string names;
  for (const SectionInfo& section : map.sections()) {
    names += section.name + " ";
  }
  EXPECT_EQ(names, "FEAT INFO NODE IDIR IMAG ");
  EXPECT_TRUE(map.has_images());
  EXPECT_FALSE(map.has_intensity_images());
  EXPECT_TRUE(map.node(0).intensity_image.empty());
  EXPECT_TRUE(map.report().empty());
  EXPECT_TRUE(verify(path()).ok());
}

TEST_F(MapRoundTrip, SameInputGivesSameBytes) {
  write_map(path("a.tmap"), 5, 20);
  write_map(path("b.tmap"), 5, 20);
  EXPECT_EQ(MapBytes(path("a.tmap")).bytes(), MapBytes(path("b.tmap")).bytes());
}

TEST_F(MapRoundTrip, SpendsAtMost40KilobytesOnANodeOf512Features) {
  const MapInfo info = make_info(64);
  const auto size_of = [&](std::size_t nodes) {
    MapWriter writer(path(), info);
    for (std::size_t i = 0; i < nodes; ++i) {
      writer.add(make_node(i, 512, info, false));
    }
    writer.finish();
    return std::filesystem::file_size(path());
  };
  EXPECT_LE(size_of(11) - size_of(1), 10U * 40'000U);
}

TEST_F(MapRoundTrip, SectionsAreAlignedAndReadInPlace) {
  write_map(path(), 3, 7);
  const MapFile map(path());
  for (const SectionInfo& section : map.sections()) {
    EXPECT_EQ(section.offset % 64, 0U);
  }
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    const NodeView node = map.node(i);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(node.features.data()) % 64, 0U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(node.descriptors.data()) % 64, 0U);
    EXPECT_GT(std::as_bytes(node.descriptors).data(), map.bytes().data());
    EXPECT_LT(std::as_bytes(node.descriptors).data(), map.bytes().data() + map.file_size());
  }
}

TEST_F(MapRoundTrip, SurvivesBeingMoved) {
  write_map(path("a.tmap"), 3, 7);
  write_map(path("b.tmap"), 4, 7);
  MapFile map(path("a.tmap"));
  MapFile other(std::move(map));
  EXPECT_EQ(other.node(2).features.size(), 9U);
  other = MapFile(path("b.tmap"));
  EXPECT_EQ(other.node_count(), 4U);
  EXPECT_FALSE(other.node(3).intensity_image.empty());
  EXPECT_TRUE(other.node_intact(3));
}

TEST_F(MapRoundTrip, RefusesAMapMadeWithAnotherModel) {
  const MapInfo info = make_info();
  write_map(path(), 1, 3, info);
  EXPECT_NO_THROW(MapFile(path(), info.model));
  ModelIdentity other = info.model;
  other.fingerprint ^= 1;
  EXPECT_THAT([&] { MapFile(path(), other); },
              ThrowsMessage<MapError>(::testing::AllOf(HasSubstr("map made with another model"),
                                                       HasSubstr("0123456789abcdef"),
                                                       HasSubstr("0123456789abcdee"))));
  other = {"aliked", info.model.fingerprint, info.model.descriptor_dim};
  EXPECT_THROW(MapFile(path(), other), MapError);
}

/// Resident kilobytes of the mapping that holds an address.
long resident_kb(const void* address) {
  std::ifstream smaps("/proc/self/smaps");
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  bool inside = false;
  for (std::string line; std::getline(smaps, line);) {
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    char dash = 0;
    std::istringstream range(line);
    if (range >> std::hex >> begin >> dash >> end && dash == '-') {
      inside = begin <= wanted && wanted < end;
    } else if (inside && line.starts_with("Rss:")) {
      return std::stol(line.substr(4));
    }
  }
  return -1;
}

TEST_F(MapRoundTrip, OpeningLeavesFeatureAndImagePagesUntouched) {
  const MapInfo info = make_info(64);
  {
    MapWriter writer(path(), info);
    NodeDraft node = make_node(0, 512, info);
    node.camera_image.resize(100'000);
    for (int i = 0; i < 300; ++i) {
      node.time_ns += 1;
      writer.add(node);
    }
    writer.finish();
  }
  const MapFile map(path());
  ASSERT_GT(map.file_size(), 40'000'000U);
  const long opened_kb = resident_kb(map.bytes().data());
  ASSERT_GT(opened_kb, 0);
  // The kernel maps up to 64 kB around each page that is touched.
  EXPECT_LT(opened_kb, 600);
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    ASSERT_TRUE(map.node_intact(i));
  }
  EXPECT_GT(resident_kb(map.bytes().data()), 300 * 38);
}

}  // namespace
}  // namespace topoloc::map::test
