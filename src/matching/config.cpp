// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config.hpp"

#include "topoloc/estimation/measurements.hpp"

#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace topoloc::matching {
namespace {

template <typename T>
void check_range(const char* key, T value, T low, T high) {
  // Written so that NaN fails too.
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument(std::string("matching.") + key + ": " + std::to_string(value) +
                                " is not in " + std::to_string(low) + " to " +
                                std::to_string(high));
  }
}

void check_choice(const char* key, const std::string& value,
                  std::initializer_list<const char*> choices) {
  std::string list;
  for (const char* choice : choices) {
    if (value == choice) {
      return;
    }
    list += list.empty() ? "" : ", ";
    list += choice;
  }
  throw std::invalid_argument(std::string("matching.") + key + ": '" + value +
                              "' is not one of: " + list);
}

}  // namespace

std::filesystem::path default_model_dir() {
  const char* from_environment = std::getenv("TOPOLOC_MODELS");
  if (from_environment != nullptr && *from_environment != '\0') {
    return from_environment;
  }
  return std::filesystem::path(TOPOLOC_SOURCE_DIR) / "third_party" / "cache" / "models";
}

PinholeCamera matching_camera(const MatchingConfig& config) {
  return {.width_px = config.width_px,
          .height_px = config.height_px,
          .fx_px = config.focal_px,
          .fy_px = config.focal_px,
          .cx_px = 0.5 * (config.width_px - 1),
          .cy_px = 0.5 * (config.height_px - 1)};
}

void validate(const MatchingConfig& config) {
  check_choice("extractor", config.extractor, {"xfeat"});
  check_choice("matcher", config.matcher, {"lighterglue", "mutual", "guided"});
  check_range("max_features", config.max_features, 16, 8192);
  check_range("width_px", config.width_px, 32, 8192);
  check_range("height_px", config.height_px, 32, 8192);
  check_range("focal_px", config.focal_px, 10.0, 1e5);
  check_range("mask_erosion_px", config.mask_erosion_px, 0, 100);
  check_range("threads", config.threads, 1, 64);
  check_choice("execution_provider", config.execution_provider, {"cpu", "cuda"});
  check_range("nodes_per_frame", config.nodes_per_frame, 1, estimation::kMaxMatchedNodes);
  check_range("max_node_distance_m", config.max_node_distance_m, 0.1, 1e4);
  check_range("max_node_heading_rad", config.max_node_heading_rad, 0.01, 3.2);
  check_range("min_similarity", config.min_similarity, -1.0, 1.0);
  check_range("min_match_score", config.min_match_score, 0.0, 1.0);
  check_range("min_features", config.min_features, 0, config.max_features);
  check_range("min_matches", config.min_matches, 4, estimation::kMaxMatches);
  check_range("pixel_std_px", config.pixel_std_px, 0.01, 100.0);
  check_range("guided.gate_sigmas", config.guided.gate_sigmas, 1.0, 10.0);
  check_range("guided.min_gate_px", config.guided.min_gate_px, 1.0, 1e4);
  check_range("guided.max_gate_px", config.guided.max_gate_px, config.guided.min_gate_px, 1e5);
  check_range("guided.ratio", config.guided.ratio, 0.1, 1.0);
  check_choice("outliers.method", config.outliers.method, {"paper", "robust"});
  check_range("outliers.sigma_th_px", config.outliers.sigma_th_px, 0.1, 1e4);
  check_range("outliers.median_sigmas", config.outliers.median_sigmas, 1.0, 100.0);
  check_range("outliers.consensus_px", config.outliers.consensus_px, 0.1, 100.0);
  check_range("outliers.consensus_iterations", config.outliers.consensus_iterations, 1, 100000);
}

}  // namespace topoloc::matching
