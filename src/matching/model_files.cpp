// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/model_files.hpp"

#include <stdexcept>
#include <string>

namespace topoloc::matching {
namespace {

std::string size(const MatchingConfig& config) {
  return std::to_string(config.width_px) + "x" + std::to_string(config.height_px);
}

std::filesystem::path in_model_dir(const MatchingConfig& config, const std::string& stem) {
  const auto dir = config.model_dir.empty() ? default_model_dir() : config.model_dir;
  return dir / (stem + "_n" + std::to_string(config.max_features) + ".onnx");
}

std::string extractor_stem(const MatchingConfig& config) {
  return config.extractor + "_" + size(config);
}

std::filesystem::path existing(const MatchingConfig& config, const std::string& stem) {
  std::filesystem::path path = in_model_dir(config, stem);
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(
        path.string() + ": no such model file; `tools/export_models.py --models " +
        config.extractor + " --sizes " + size(config) + " --features " +
        std::to_string(config.max_features) +
        "` makes it (docs/models.md; models of your own too), or set TOPOLOC_MODELS or "
        "matching.model_dir to the folder that has it");
  }
  return path;
}

}  // namespace

std::filesystem::path extractor_file(const MatchingConfig& config) {
  return existing(config, extractor_stem(config));
}

bool has_extractor_file(const MatchingConfig& config) {
  return std::filesystem::exists(in_model_dir(config, extractor_stem(config)));
}

MatchingConfig band_of(MatchingConfig config) {
  constexpr int kStep_px = 32;
  config.max_features /= 2;
  config.height_px = (config.height_px + 2 * kStep_px - 1) / (2 * kStep_px) * kStep_px;
  return config;
}

std::filesystem::path lightglue_file(const MatchingConfig& config) {
  const bool small = config.matcher == "lighterglue";
  if (small != (config.extractor == "xfeat")) {
    throw std::invalid_argument(
        "matching.matcher: '" + config.matcher + "' is not for extractor '" + config.extractor +
        "', which needs " + (small ? "'lightglue'" : "'lighterglue'") + ", 'mutual' or 'guided'");
  }
  return existing(config,
                  small ? "lighterglue"
                        : "lightglue-" + config.extractor.substr(0, config.extractor.find('-')));
}

}  // namespace topoloc::matching
