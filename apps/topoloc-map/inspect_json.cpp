// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "inspect_json.hpp"

#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace topoloc::apps {
namespace {

using map::MapFile;
using map::MapInfo;
using map::MapSummary;
using map::SectionInfo;
using map::Spread;
using nlohmann::ordered_json;

/// Text of a 64-bit number: JSON readers lose digits of large ones.
std::string hex(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

ordered_json spread_json(const Spread& s) {
  return {{"min", s.min}, {"median", s.median}, {"mean", s.mean}, {"max", s.max}};
}

ordered_json map_json(const MapFile& map, const MapSummary& summary) {
  const MapInfo& info = map.info();
  const topoloc::PinholeCamera& camera = info.camera;
  const Eigen::Quaterniond q = info.T_imu_cam.quaternion();
  ordered_json gaps = ordered_json::array();
  for (const auto& gap : summary.gaps) {
    gaps.push_back({{"after_node", gap.after_node}, {"length_m", gap.length_m}});
  }
  ordered_json sections = ordered_json::array();
  for (const SectionInfo& section : map.sections()) {
    sections.push_back({{"name", section.name},
                        {"version", section.version},
                        {"required", section.required},
                        {"known", section.known},
                        {"offset", section.offset},
                        {"length", section.length},
                        {"checksum", hex(section.checksum)}});
  }
  return {{"file", map.path().string()},
          {"file_size", map.file_size()},
          {"stripped", !map.has_images()},
          {"intensity_images", map.has_intensity_images()},
          {"nodes", summary.node_count},
          {"first_time_ns", summary.first_time_ns},
          {"last_time_ns", summary.last_time_ns},
          {"length_m", summary.length_m},
          {"spacing_m", spread_json(summary.spacing_m)},
          {"gaps", gaps},
          {"features", spread_json(summary.features)},
          {"lifted_share", spread_json(summary.lifted_share)},
          {"depth_std_m", spread_json(summary.depth_std_m)},
          {"model",
           {{"name", info.model.name},
            {"fingerprint", hex(info.model.fingerprint)},
            {"descriptor_dim", info.model.descriptor_dim}}},
          {"camera",
           {{"width_px", camera.width_px},
            {"height_px", camera.height_px},
            {"fx_px", camera.fx_px},
            {"fy_px", camera.fy_px},
            {"cx_px", camera.cx_px},
            {"cy_px", camera.cy_px}}},
          {"T_imu_cam",
           {{"p_m", {info.T_imu_cam.p.x(), info.T_imu_cam.p.y(), info.T_imu_cam.p.z()}},
            {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
          {"origin_m", {info.origin_m.x(), info.origin_m.y(), info.origin_m.z()}},
          {"crs", info.crs},
          {"creator", info.creator},
          {"sections", sections}};
}

/// Rows of the covariance of a node's camera pose (docs/map-format.md); null for rejected ones.
ordered_json covariance_json(const QualityNode& node, const map::MapFile& map) {
  if (!node.id) {
    return {};
  }
  ordered_json rows = ordered_json::array();
  const Eigen::Matrix<double, 6, 6> P = map.node(*node.id).covariance;
  for (int i = 0; i < 6; ++i) {
    rows.push_back(std::vector<double>(P.col(i).begin(), P.col(i).end()));  // symmetric
  }
  return rows;
}

ordered_json node_json(const QualityNode& node, const map::MapFile& map, bool has_report) {
  const mapping::NodeReport& report = node.report;
  return {{"node", node.id ? ordered_json(*node.id) : ordered_json()},
          {"frame", has_report ? ordered_json(report.frame) : ordered_json()},
          {"time_ns", report.time_ns},
          {"along_m", node.along_m},
          {"position_m", {report.position_m.x(), report.position_m.y(), report.position_m.z()}},
          {"rejected", report.rejected ? ordered_json(*report.rejected) : ordered_json()},
          {"covariance", covariance_json(node, map)},
          {"figures", report.figures}};
}

/// Spreads of all figures over the accepted nodes, or over those rejected for a reason.
ordered_json figures_json(const MapQuality& quality, const std::optional<std::string>& reason) {
  ordered_json out = ordered_json::object();
  for (const std::string& name : quality.figure_names()) {
    const std::vector<double> values = quality.values(name, reason);
    if (!values.empty()) {
      out[name] = spread_json(Spread::of(values));
    }
  }
  return out;
}

ordered_json build_json(const MapQuality& quality, const map::MapFile& map) {
  ordered_json out{{"has_report", quality.has_report}};
  if (quality.has_report) {
    out["refine"] = quality.build.refine;
    out["cloud_points"] = quality.build.cloud_points;
    out["cloud_has_intensity"] = quality.build.cloud_has_intensity;
    out["planned"] = quality.nodes.size();
  }
  out["accepted"] = {{"nodes", quality.accepted()}, {"figures", figures_json(quality, {})}};
  out["rejected"] = ordered_json::object();
  for (const auto& [reason, count] : quality.rejected) {
    out["rejected"][reason] = {{"nodes", count}, {"figures", figures_json(quality, reason)}};
  }
  out["gaps"] = ordered_json::array();
  for (const mapping::NodeGap& gap : quality.gaps) {
    out["gaps"].push_back({{"after_node", *quality.nodes[gap.after].id},
                           {"from_m", quality.nodes[gap.after].along_m},
                           {"length_m", gap.length_m},
                           {"rejected_nodes", gap.before - gap.after - 1}});
  }
  out["nodes"] = ordered_json::array();
  for (const QualityNode& node : quality.nodes) {
    out["nodes"].push_back(node_json(node, map, quality.has_report));
  }
  return out;
}

}  // namespace

std::string inspect_json(const MapFile& map, const MapSummary& summary, const MapQuality& quality) {
  ordered_json out = map_json(map, summary);
  out["build"] = build_json(quality, map);
  return out.dump(2) + "\n";
}

}  // namespace topoloc::apps
