// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/map_report.hpp"

#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace topoloc::mapping {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::ThrowsMessage;

/// Nodes 10 m apart; '+' accepted, '-' rejected.
std::vector<NodeReport> chain(std::string_view verdicts) {
  std::vector<NodeReport> nodes;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    NodeReport& node = nodes.emplace_back();
    node.frame = 7 * i;
    node.time_ns = 1'317'000'000'123'456'789 + static_cast<std::int64_t>(i);
    node.position_m = {10.0 * static_cast<double>(i), -1.0 / 3.0, 2.5};
    if (verdicts[i] == '-') {
      node.rejected = "too_dark";
    }
    node.figures = {{"std_m", 0.1 + static_cast<double>(i)}};
  }
  return nodes;
}

TEST(MapReport, ComesBackFromJsonUnchanged) {
  MapReport report{"a \"b\"", "auto", 12'345'678'901, true, chain("+-+")};
  const MapReport back = parse_map_report(to_json(report));
  EXPECT_EQ(back.creator, report.creator);
  EXPECT_EQ(back.refine, report.refine);
  EXPECT_EQ(back.cloud_points, report.cloud_points);
  EXPECT_EQ(back.cloud_has_intensity, report.cloud_has_intensity);
  ASSERT_EQ(back.nodes.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back.nodes[i].frame, report.nodes[i].frame);
    EXPECT_EQ(back.nodes[i].time_ns, report.nodes[i].time_ns);
    EXPECT_EQ(back.nodes[i].position_m, report.nodes[i].position_m);
    EXPECT_EQ(back.nodes[i].rejected, report.nodes[i].rejected);
    EXPECT_EQ(back.nodes[i].figures, report.nodes[i].figures);
  }
  EXPECT_EQ(to_json(back), to_json(report));
}

TEST(MapReport, JsonHoldsTheTotals) {
  MapReport report;
  report.nodes = chain("+--+");
  report.nodes[1].rejected = "too_bright";
  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(json.at("planned"), 4);
  EXPECT_EQ(json.at("accepted"), 2);
  EXPECT_EQ(json.at("rejected"), (nlohmann::json{{"too_bright", 1}, {"too_dark", 1}}));
  ASSERT_EQ(json.at("gaps").size(), 1U);
  EXPECT_EQ(json.at("gaps")[0].at("after_frame"), 0);
  EXPECT_EQ(json.at("gaps")[0].at("before_frame"), 21);
  EXPECT_DOUBLE_EQ(json.at("gaps")[0].at("length_m").get<double>(), 30.0);
  EXPECT_EQ(json.at("nodes").size(), 4U);
}

TEST(MapReport, GapsAreMeasuredAlongTheRejectedNodes) {
  EXPECT_TRUE(find_gaps(chain("+-+-+")).empty());
  // A hairpin: 10 m apart as the crow flies, 40 m along the way.
  auto nodes = chain("+---+");
  nodes[3].position_m = nodes[1].position_m;
  nodes[4].position_m = nodes[0].position_m;
  const auto gaps = find_gaps(nodes);
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].after, 0U);
  EXPECT_EQ(gaps[0].before, 4U);
  EXPECT_DOUBLE_EQ(gaps[0].length_m, 40.0);
  EXPECT_TRUE(find_gaps(chain("----+")).empty()) << "not between two accepted nodes";
}

TEST(MapReport, CountsByReason) {
  auto nodes = chain("-+-+-");
  nodes[2].rejected = "too_bright";
  EXPECT_THAT(count_rejected(nodes), ElementsAre(Pair("too_bright", 1U), Pair("too_dark", 2U)));
}

TEST(MapReport, FiguresThatAreNotFiniteAreLeftOut) {
  MapReport report;
  report.nodes = chain("+");
  report.nodes[0].figures = {{"good", 1.0}, {"nan", NAN}, {"inf", INFINITY}};
  EXPECT_THAT(parse_map_report(to_json(report)).nodes[0].figures, ElementsAre(Pair("good", 1.0)));
}

TEST(MapReport, SaysWhatIsWrongWithAText) {
  const auto refused = [](const char* text, const char* why) {
    EXPECT_THAT([&] { (void)parse_map_report(text); },
                ThrowsMessage<std::runtime_error>(
                    ::testing::AllOf(HasSubstr("build report: "), HasSubstr(why))));
  };
  refused("", "parse error");
  refused("[]", "at()");
  refused(R"({"format": 2})", "format 2");
  refused(R"({"format": 1})", "creator");
}

}  // namespace
}  // namespace topoloc::mapping
