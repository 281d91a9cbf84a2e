// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/summary.hpp"

#include "map_fixture.hpp"

namespace topoloc::map::test {
namespace {

class Summary : public MapTest {};

TEST_F(Summary, FindsLengthSpacingAndGaps) {
  const MapInfo info = make_info();
  MapWriter writer(path(), info);
  const double x_m[] = {0.0, 5.0, 10.0, 31.0, 35.0};
  for (std::size_t i = 0; i < 5; ++i) {
    NodeDraft node = make_node(i, 3 * i, info);
    node.T_world_cam.p = {x_m[i], 0.0, 0.0};
    writer.add(node);
  }
  writer.finish();
  const MapSummary summary = summarise(MapFile(path()));
  EXPECT_EQ(summary.node_count, 5U);
  EXPECT_DOUBLE_EQ(summary.length_m, 35.0);
  EXPECT_DOUBLE_EQ(summary.spacing_m.min, 4.0);
  EXPECT_DOUBLE_EQ(summary.spacing_m.median, 5.0);
  EXPECT_DOUBLE_EQ(summary.spacing_m.max, 21.0);
  ASSERT_EQ(summary.gaps.size(), 1U);
  EXPECT_EQ(summary.gaps[0].after_node, 2U);
  EXPECT_DOUBLE_EQ(summary.gaps[0].length_m, 21.0);
  EXPECT_DOUBLE_EQ(summary.features.mean, 6.0);
  EXPECT_NEAR(summary.lifted_share.max, 2.0 / 3.0, 1e-6);
  EXPECT_EQ(summary.last_time_ns - summary.first_time_ns, 400'000'000);
}

TEST_F(Summary, TakesAMapOfOneNode) {
  write_map(path(), 1, 0);
  const MapSummary summary = summarise(MapFile(path()));
  EXPECT_EQ(summary.length_m, 0.0);
  EXPECT_EQ(summary.spacing_m.max, 0.0);
  EXPECT_TRUE(summary.gaps.empty());
}

}  // namespace
}  // namespace topoloc::map::test
