// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/measurements.hpp"

#include "config/sections.hpp"

#include <numbers>

namespace topoloc::config {
namespace {

void read_guided(StrictNode& matching, matching::GuidedConfig& config) {
  StrictNode guided = matching.section("guided");
  guided.read("gate_sigmas", config.gate_sigmas, positive_up_to(100.0));
  guided.read("min_gate_px", config.min_gate_px, positive_up_to(1000.0));
  guided.read("max_gate_px", config.max_gate_px, positive_up_to(10000.0));
  guided.read("ratio", config.ratio, positive_up_to(1.0));
  guided.finish();
}

void read_outliers(StrictNode& matching, matching::OutlierConfig& config) {
  StrictNode outliers = matching.section("outliers");
  outliers.read("method", config.method, {"paper", "robust"});
  outliers.read("sigma_th_px", config.sigma_th_px, positive_up_to(1000.0));
  outliers.read("median_sigmas", config.median_sigmas, positive_up_to(100.0));
  outliers.read("consensus_px", config.consensus_px, positive_up_to(100.0));
  outliers.read("consensus_iterations", config.consensus_iterations, {1, 100000});
  outliers.finish();
}

}  // namespace

void read_matching(StrictNode& top, matching::MatchingConfig& config) {
  StrictNode node = top.section("matching");
  node.read("extractor", config.extractor);
  node.read("matcher", config.matcher, {"lighterglue", "mutual", "guided"});
  node.read("max_features", config.max_features, {16, estimation::kMaxMatches});
  node.read("width_px", config.width_px, {64, 4096});
  node.read("height_px", config.height_px, {64, 4096});
  node.read("focal_px", config.focal_px, positive_up_to(10000.0));
  node.read("mask_erosion_px", config.mask_erosion_px, {0, 100});
  std::string model_dir;
  node.read("model_dir", model_dir);
  if (!model_dir.empty()) {
    config.model_dir = node.resolve(model_dir);
  }
  node.read("threads", config.threads, {1, 256});
  node.read("execution_provider", config.execution_provider, {"cpu", "cuda"});
  node.read("nodes_per_frame", config.nodes_per_frame, {1, estimation::kMaxMatchedNodes});
  node.read("max_node_distance_m", config.max_node_distance_m, positive_up_to(1000.0));
  node.read("max_node_heading_rad", config.max_node_heading_rad, positive_up_to(std::numbers::pi));
  node.read("min_similarity", config.min_similarity, {-1.0, 1.0});
  node.read("min_match_score", config.min_match_score, {0.0, 1.0});
  node.read("min_features", config.min_features, {0, estimation::kMaxMatches});
  node.read("min_matches", config.min_matches, {3, estimation::kMaxMatches});
  node.read("pixel_std_px", config.pixel_std_px, positive_up_to(100.0));
  read_guided(node, config.guided);
  read_outliers(node, config.outliers);
  node.finish();
  try {
    validate(config);
  } catch (const std::invalid_argument& error) {
    throw top.error("matching", error.what());
  }
}

}  // namespace topoloc::config
