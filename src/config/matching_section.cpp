// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config_keys.hpp"

#include "config/sections.hpp"

namespace topoloc::config {
namespace {

/// Reads the keys of one map as the matching module states them.
class KeyReader {
 public:
  explicit KeyReader(StrictNode& node) : node_(node) {}

  template <typename Number>
  void operator()(const char* key, Number& target, double low, double high) {
    node_.read(key, target, Range{low, high});
  }
  void operator()(const char* key, std::string& target, const std::vector<std::string>& choices) {
    node_.read(key, target, choices);
  }
  void operator()(const char* key, std::string& name) {
    node_.read(key, name);
    if (!matching::is_model_name(name)) {
      throw node_.error(
          key, std::string("expected ") + matching::kModelNameRule + ", found '" + name + "'");
    }
  }

 private:
  StrictNode& node_;
};

}  // namespace

void read_matching(StrictNode& top, matching::MatchingConfig& config) {
  StrictNode node = top.section("matching");
  matching::visit_matching_keys(config, KeyReader(node));
  std::string model_dir;
  node.read("model_dir", model_dir);
  if (!model_dir.empty()) {
    config.model_dir = node.resolve(model_dir);
  }
  StrictNode guided = node.section("guided");
  matching::visit_guided_keys(config.guided, KeyReader(guided));
  guided.finish();
  StrictNode outliers = node.section("outliers");
  matching::visit_outlier_keys(config.outliers, KeyReader(outliers));
  outliers.finish();
  node.finish();
}

}  // namespace topoloc::config
