// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"

#include "map_fixture.hpp"

#include <csignal>
#include <functional>
#include <limits>
#include <string>
#include <sys/resource.h>

#include <gmock/gmock.h>

namespace topoloc::map::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class MapWriting : public MapTest {};

TEST_F(MapWriting, RefusesBadNodesAndGoesOn) {
  const MapInfo info = make_info();
  MapWriter writer(path(), info);
  writer.add(make_node(0, 3, info));
  const auto refused = [&](const char* why, const std::function<void(NodeDraft&)>& change) {
    NodeDraft node = make_node(1, 3, info);
    change(node);
    EXPECT_THAT([&] { writer.add(node); },
                ThrowsMessage<MapError>(AllOf(HasSubstr("test.tmap: node 1: "), HasSubstr(why))));
  };
  refused("is not after", [](NodeDraft& n) { n.time_ns -= 100'000'000; });
  refused("position", [](NodeDraft& n) { n.T_world_cam.p.y() = kNaN; });
  refused("position", [](NodeDraft& n) { n.T_world_cam.p.y() = 1e12; });
  refused("rotation", [](NodeDraft& n) { n.T_world_cam.R(1, 2) = kNaN; });
  refused("rotation", [](NodeDraft& n) { n.T_world_cam.R *= 1.001; });
  refused("rotation", [](NodeDraft& n) { n.T_world_cam.R.col(0) *= -1.0; });
  refused("covariance", [](NodeDraft& n) { n.covariance(0, 0) = kNaN; });
  refused("covariance", [](NodeDraft& n) { n.covariance(0, 1) += 1e-3; });
  refused("covariance", [](NodeDraft& n) { n.covariance *= -1.0; });
  refused("covariance", [](NodeDraft& n) { n.covariance(2, 2) = 0.0; });
  refused("covariance", [](NodeDraft& n) { n.covariance *= 1e60; });
  refused("descriptor values, expected 3 x 8", [](NodeDraft& n) { n.descriptors.pop_back(); });
  refused("feature 2: pixel", [](NodeDraft& n) { n.features[2].pixel_px.x() = 63.1F; });
  refused("feature 2: pixel", [](NodeDraft& n) { n.features[2].pixel_px.y() = -0.1F; });
  refused("feature 2: pixel", [](NodeDraft& n) { n.features[2].pixel_px.y() = NAN; });
  refused("feature 1: depth", [](NodeDraft& n) { n.features[1].depth_m = -1.0F; });
  refused("feature 1: depth", [](NodeDraft& n) { n.features[1].depth_m = INFINITY; });
  refused("feature 1: depth dev", [](NodeDraft& n) { n.features[1].depth_std_m = NAN; });
  refused("feature 0: score", [](NodeDraft& n) { n.features[0].score = NAN; });
  refused("features, at most", [&](NodeDraft& n) { n = make_node(1, 16385, info); });
  refused("neither JPEG nor PNG", [](NodeDraft& n) { n.camera_image[0] = std::byte{'B'}; });
  refused("depth image of 2 x 1 px", [](NodeDraft& n) {
    n.depth_image = encode_depth(std::vector<float>{1.0F, 2.0F}, 2, 1);
  });
  refused("intensity image of 2 x 1 px", [](NodeDraft& n) {
    n.intensity_image = encode_intensity(std::vector<std::uint8_t>{1, 2}, 2, 1);
  });
  refused("does not begin with TIZ1", [](NodeDraft& n) { n.intensity_image = n.depth_image; });
}

TEST_F(MapWriting, RefusesAReportThatIsNotJsonInUtf8) {
  MapWriter writer(path(), make_info());
  const auto refused = [&](const char* text) {
    EXPECT_THAT([&] { writer.set_report(text); },
                ThrowsMessage<MapError>(AllOf(HasSubstr("test.tmap"), HasSubstr("not JSON"))));
  };
  refused("{");
  refused("nodes: 3");
  refused("\"\xff\"");
}

TEST_F(MapWriting, ARefusedNodeLeavesTheMapAsItWas) {
  const MapInfo info = make_info();
  {
    MapWriter writer(path(), info);
    writer.add(make_node(0, 3, info));
    NodeDraft bad = make_node(1, 30, info);
    bad.features.back().score = NAN;
    EXPECT_THROW(writer.add(bad), MapError);
    writer.add(make_node(1, 4, info));
    EXPECT_THROW(writer.set_report("{"), MapError);
    writer.set_report(R"({"planned": 2})");
    writer.finish();
  }
  write_map(path("good.tmap"), 2, 3, info);
  EXPECT_EQ(MapBytes(path()).bytes(), MapBytes(path("good.tmap")).bytes());
}

TEST_F(MapWriting, RefusesBadInfo) {
  const auto refused = [&](const std::function<void(MapInfo&)>& change) {
    MapInfo info = make_info();
    change(info);
    EXPECT_THROW(MapWriter(path(), info), MapError);
  };
  refused([](MapInfo& info) { info.camera.width_px = 2049; });
  refused([](MapInfo& info) { info.camera.fx_px = 0.0; });
  refused([](MapInfo& info) { info.T_imu_cam.R *= 2.0; });
  refused([](MapInfo& info) { info.model.descriptor_dim = 0; });
  refused([](MapInfo& info) { info.model.name.clear(); });
  refused([](MapInfo& info) { info.origin_m.x() = kNaN; });
  refused([](MapInfo& info) { info.crs = "a\nb"; });
  EXPECT_TRUE(files().empty());
}

TEST_F(MapWriting, TheMapAppearsOnlyWhenFinished) {
  const MapInfo info = make_info();
  write_map(path(), 1, 2, info);
  const std::string before = MapBytes(path()).bytes();
  {
    MapWriter writer(path(), info);
    writer.add(make_node(0, 9, info));
    EXPECT_EQ(MapBytes(path()).bytes(), before);
  }
  EXPECT_EQ(MapBytes(path()).bytes(), before);
  EXPECT_THAT(files(), ElementsAre("test.tmap"));
  write_map(path(), 2, 9, info);
  EXPECT_NE(MapBytes(path()).bytes(), before);
  EXPECT_THAT(files(), ElementsAre("test.tmap"));
}

TEST_F(MapWriting, RefusesAMapWithoutNodes) {
  MapWriter writer(path(), make_info());
  EXPECT_THROW(writer.finish(), MapError);
}

TEST_F(MapWriting, FinishesOnce) {
  const MapInfo info = make_info();
  MapWriter writer(path(), info);
  writer.add(make_node(0, 1, info));
  writer.finish();
  EXPECT_THROW(writer.finish(), MapError);
  EXPECT_THROW(writer.add(make_node(1, 1, info)), MapError);
}

TEST_F(MapWriting, NamesAFolderThatIsNotThere) {
  EXPECT_THAT([&] { MapWriter(path("missing/a.tmap"), make_info()); },
              ThrowsMessage<MapError>(HasSubstr("missing/a.tmap: cannot create")));
}

TEST_F(MapWriting, AFailedWriteIsAnErrorAndLeavesTheOldMap) {
  const MapInfo info = make_info();
  write_map(path(), 1, 2, info);
  const std::string before = MapBytes(path()).bytes();
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  rlimit small = old_limit;
  small.rlim_cur = 20'000;
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THAT([&] { write_map(path(), 20, 200, info); },
              ThrowsMessage<MapError>(HasSubstr("test.tmap: cannot write")));
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(MapBytes(path()).bytes(), before);
  EXPECT_THAT(files(), ElementsAre("test.tmap"));
}

TEST_F(MapWriting, StripRemovesTheImagesAndNothingElse) {
  write_map(path("full.tmap"), 4, 6, make_info(), true);
  write_map(path("without.tmap"), 4, 6, make_info(), false);
  strip(path("full.tmap"), path("stripped.tmap"));
  EXPECT_EQ(MapBytes(path("stripped.tmap")).bytes(), MapBytes(path("without.tmap")).bytes());
  EXPECT_TRUE(verify(path("stripped.tmap")).ok());
  const MapFile stripped(path("stripped.tmap"));
  EXPECT_TRUE(stripped.node(3).depth_image.empty());
  EXPECT_FALSE(stripped.has_intensity_images());
  EXPECT_TRUE(stripped.node(3).intensity_image.empty());
  EXPECT_EQ(stripped.report(), R"({"planned": 4})");
}

TEST_F(MapWriting, StripWorksInPlaceAndTwice) {
  write_map(path(), 4, 6);
  const MapFile open_before(path());
  strip(path(), path());
  const std::string once = MapBytes(path()).bytes();
  strip(path(), path());
  EXPECT_EQ(MapBytes(path()).bytes(), once);
  EXPECT_FALSE(MapFile(path()).has_images());
  // Who has the old map open keeps it.
  EXPECT_FALSE(open_before.node(3).depth_image.empty());
  EXPECT_TRUE(open_before.node_intact(3));
}

}  // namespace
}  // namespace topoloc::map::test
