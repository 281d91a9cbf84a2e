// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/map/types.hpp"
#include "topoloc/matching/config.hpp"

#include <numbers>
#include <string>
#include <vector>

/// The only place that knows the names and ranges of the keys of MatchingConfig (but model_dir).
/// Each function calls visit(key, value, low, high), both ends allowed, visit(key, value, choices)
/// or visit(key, value), which is part of a file name (see is_model_name()), in the order in which
/// a bound may depend on another key.
namespace topoloc::matching {

template <typename Config, typename Visitor>
void visit_matching_keys(Config& config, Visitor&& visit) {
  visit("extractor", config.extractor);
  visit("matcher", config.matcher,
        std::vector<std::string>{"lighterglue", "lightglue", "mutual", "ratio", "guided"});
  visit("max_features", config.max_features, 16, estimation::kMaxMatches);
  visit("width_px", config.width_px, 64, map::kMaxImageSide_px);
  visit("height_px", config.height_px, 64, map::kMaxImageSide_px);
  visit("focal_px", config.focal_px, 10, 10000);
  visit("mask_erosion_px", config.mask_erosion_px, 0, 100);
  visit("threads", config.threads, 1, 64);
  visit("execution_provider", config.execution_provider, std::vector<std::string>{"cpu", "cuda"});
  visit("nodes_per_frame", config.nodes_per_frame, 1, estimation::kMaxMatchedNodes);
  visit("max_node_distance_m", config.max_node_distance_m, 0.1, 1000);
  visit("max_node_heading_rad", config.max_node_heading_rad, 0.01, std::numbers::pi);
  visit("min_similarity", config.min_similarity, -1, 1);
  visit("max_ratio", config.max_ratio, 0.1, 1);
  visit("min_match_score", config.min_match_score, 0, 1);
  visit("min_features", config.min_features, 0, config.max_features);
  visit("min_matches", config.min_matches, 4, estimation::kMaxMatches);
  visit("pixel_std_px", config.pixel_std_px, 0.01, 100);
}

template <typename Config, typename Visitor>
void visit_guided_keys(Config& guided, Visitor&& visit) {
  visit("gate_sigmas", guided.gate_sigmas, 1, 10);
  visit("min_gate_px", guided.min_gate_px, 1, 1000);
  visit("max_gate_px", guided.max_gate_px, guided.min_gate_px, 10000);
  visit("ratio", guided.ratio, 0.1, 1);
}

template <typename Config, typename Visitor>
void visit_outlier_keys(Config& outliers, Visitor&& visit) {
  visit("method", outliers.method, std::vector<std::string>{"paper", "robust", "none"});
  visit("sigma_th_px", outliers.sigma_th_px, 0.1, 1000);
  visit("median_sigmas", outliers.median_sigmas, 1, 100);
  visit("consensus_px", outliers.consensus_px, 0.1, 100);
  visit("consensus_iterations", outliers.consensus_iterations, 1, 100000);
}

}  // namespace topoloc::matching
