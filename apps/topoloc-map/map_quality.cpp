// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map_quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include <Eigen/Eigenvalues>

namespace topoloc::apps {
namespace {

constexpr std::array kOfTheMap{kPositionStd, kRotationStd, "features", kLiftedShare};

/// Standard deviation in the worst direction.
double largest_std(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues().maxCoeff(), 0.0));
}

void add_figures_of_the_map(const map::NodeView& node, mapping::Figures& figures) {
  figures[kPositionStd] = largest_std(node.covariance.bottomRightCorner<3, 3>());
  figures[kRotationStd] =
      largest_std(node.covariance.topLeftCorner<3, 3>()) * 180.0 / std::numbers::pi;
  figures["features"] = node.quality.feature_count;
  figures["lifted"] = node.quality.lifted_count;
  if (node.quality.lifted_count > 0) {
    figures["mean_depth_std_m"] = static_cast<double>(node.quality.mean_depth_std_m);
  }
}

void add_lifted_share(mapping::Figures& figures) {
  const auto features = figures.find("features");
  const auto lifted = figures.find("lifted");
  if (features != figures.end() && lifted != figures.end() && features->second > 0.0) {
    figures[kLiftedShare] = lifted->second / features->second;
  }
}

/// What a report would say of the nodes in the map.
std::vector<mapping::NodeReport> accepted_nodes(const map::MapFile& map) {
  const RigidTransform T_cam_imu = map.info().T_imu_cam.inverse();
  std::vector<mapping::NodeReport> nodes(map.node_count());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].time_ns = map.node(i).time_ns;
    nodes[i].position_m = (map.T_world_cam(i) * T_cam_imu).p;
  }
  return nodes;
}

mapping::MapReport read_report(const map::MapFile& map) {
  try {
    return mapping::parse_map_report(map.report());
  } catch (const map::MapError&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error(map.path().string() + ": " + error.what());
  }
}

}  // namespace

std::optional<double> QualityNode::figure(const std::string& name) const {
  const auto found = report.figures.find(name);
  return found == report.figures.end() ? std::nullopt : std::optional(found->second);
}

std::size_t MapQuality::accepted() const {
  return static_cast<std::size_t>(
      std::count_if(nodes.begin(), nodes.end(), [](const auto& node) { return node.accepted(); }));
}

std::vector<std::string> MapQuality::figure_names() const {
  std::vector<std::string> names(kOfTheMap.begin(), kOfTheMap.end());
  std::set<std::string> others;
  for (const QualityNode& node : nodes) {
    for (const auto& [name, value] : node.report.figures) {
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        others.insert(name);
      }
    }
  }
  names.insert(names.end(), others.begin(), others.end());
  return names;
}

std::vector<double> MapQuality::values(const std::string& figure,
                                       const std::optional<std::string>& rejected_for) const {
  std::vector<double> values;
  for (const QualityNode& node : nodes) {
    const auto value = node.figure(figure);
    if (value && node.report.rejected == rejected_for) {
      values.push_back(*value);
    }
  }
  return values;
}

MapQuality read_quality(const map::MapFile& map) {
  MapQuality quality;
  quality.has_report = !map.report().empty();
  std::vector<mapping::NodeReport> nodes = accepted_nodes(map);
  if (quality.has_report) {
    quality.build = read_report(map);
    nodes = std::move(quality.build.nodes);
  }
  quality.gaps = mapping::find_gaps(nodes);
  quality.rejected = mapping::count_rejected(nodes);

  std::uint32_t next_id = 0;
  for (mapping::NodeReport& report : nodes) {
    QualityNode node;
    if (!quality.nodes.empty()) {
      const QualityNode& last = quality.nodes.back();
      node.along_m = last.along_m + (report.position_m - last.report.position_m).norm();
    }
    if (!report.rejected) {
      if (next_id == map.node_count() || map.node(next_id).time_ns != report.time_ns) {
        throw std::runtime_error(map.path().string() + ": its build report says that frame " +
                                 std::to_string(report.frame) +
                                 " is a node, which the map does not hold");
      }
      add_figures_of_the_map(map.node(next_id), report.figures);
      node.id = next_id++;
    }
    add_lifted_share(report.figures);
    node.report = std::move(report);
    quality.nodes.push_back(std::move(node));
  }
  if (next_id != map.node_count()) {
    throw std::runtime_error(map.path().string() + ": its build report accepts " +
                             std::to_string(next_id) + " nodes, the map holds " +
                             std::to_string(map.node_count()));
  }
  return quality;
}

}  // namespace topoloc::apps
