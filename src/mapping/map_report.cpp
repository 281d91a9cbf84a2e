// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/map_report.hpp"

#include <cmath>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace topoloc::mapping {
namespace {

using nlohmann::ordered_json;

constexpr int kReportFormat = 1;

ordered_json figures_json(const Figures& figures) {
  ordered_json out = ordered_json::object();
  for (const auto& [name, value] : figures) {
    if (std::isfinite(value)) {
      out[name] = value;
    }
  }
  return out;
}

ordered_json node_json(const NodeReport& node) {
  return {{"frame", node.frame},
          {"time_ns", node.time_ns},
          {"position_m", {node.position_m.x(), node.position_m.y(), node.position_m.z()}},
          {"rejected", node.rejected ? ordered_json(*node.rejected) : ordered_json()},
          {"figures", figures_json(node.figures)}};
}

NodeReport parse_node(const ordered_json& json) {
  NodeReport node;
  node.frame = json.at("frame").get<std::size_t>();
  node.time_ns = json.at("time_ns").get<std::int64_t>();
  const ordered_json& position = json.at("position_m");
  for (std::size_t i = 0; i < 3; ++i) {
    node.position_m[static_cast<Eigen::Index>(i)] = position.at(i).get<double>();
  }
  if (!json.at("rejected").is_null()) {
    node.rejected = json.at("rejected").get<std::string>();
  }
  for (const auto& [name, value] : json.at("figures").items()) {
    node.figures[name] = value.get<double>();
  }
  return node;
}

}  // namespace

std::vector<NodeGap> find_gaps(std::span<const NodeReport> nodes) {
  std::vector<NodeGap> gaps;
  std::optional<std::size_t> last_accepted;
  double way_m = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i > 0) {
      way_m += (nodes[i].position_m - nodes[i - 1].position_m).norm();
    }
    if (nodes[i].rejected) {
      continue;
    }
    if (last_accepted && way_m > kReportedGap_m) {
      gaps.push_back({*last_accepted, i, way_m});
    }
    last_accepted = i;
    way_m = 0.0;
  }
  return gaps;
}

std::map<std::string, std::size_t> count_rejected(std::span<const NodeReport> nodes) {
  std::map<std::string, std::size_t> counts;
  for (const NodeReport& node : nodes) {
    if (node.rejected) {
      ++counts[*node.rejected];
    }
  }
  return counts;
}

std::string to_json(const MapReport& report) {
  ordered_json rejected = ordered_json::object();
  std::size_t accepted = report.nodes.size();
  for (const auto& [reason, count] : count_rejected(report.nodes)) {
    rejected[reason] = count;
    accepted -= count;
  }
  ordered_json gaps = ordered_json::array();
  for (const NodeGap& gap : find_gaps(report.nodes)) {
    gaps.push_back({{"after_frame", report.nodes[gap.after].frame},
                    {"before_frame", report.nodes[gap.before].frame},
                    {"length_m", gap.length_m}});
  }
  ordered_json nodes = ordered_json::array();
  for (const NodeReport& node : report.nodes) {
    nodes.push_back(node_json(node));
  }
  const ordered_json json{{"format", kReportFormat},
                          {"creator", report.creator},
                          {"refine", report.refine},
                          {"cloud_points", report.cloud_points},
                          {"cloud_has_intensity", report.cloud_has_intensity},
                          {"planned", report.nodes.size()},
                          {"accepted", accepted},
                          {"rejected", rejected},
                          {"gaps", gaps},
                          {"nodes", nodes}};
  return json.dump();
}

MapReport parse_map_report(std::string_view json) {
  try {
    const ordered_json in = ordered_json::parse(json);
    if (in.at("format").get<int>() != kReportFormat) {
      throw std::runtime_error("format " + in.at("format").dump() + ", this program reads format " +
                               std::to_string(kReportFormat));
    }
    MapReport report;
    report.creator = in.at("creator").get<std::string>();
    report.refine = in.at("refine").get<std::string>();
    report.cloud_points = in.at("cloud_points").get<std::uint64_t>();
    report.cloud_has_intensity = in.at("cloud_has_intensity").get<bool>();
    for (const ordered_json& node : in.at("nodes")) {
      report.nodes.push_back(parse_node(node));
    }
    return report;
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("build report: ") + error.what());
  }
}

}  // namespace topoloc::mapping
