// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config.hpp"

#include "topoloc/matching/config_keys.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace topoloc::matching {
namespace {

/// Complains about a key out of range; `prefix` are the sections around it.
class KeyCheck {
 public:
  explicit KeyCheck(const char* prefix) : prefix_(prefix) {}

  void operator()(const char* key, double value, double low, double high) const {
    // Written so that NaN fails too.
    if (!(value >= low && value <= high)) {
      throw std::invalid_argument(prefix_ + key + ": " + std::to_string(value) + " is not in " +
                                  std::to_string(low) + " to " + std::to_string(high));
    }
  }
  void operator()(const char* key, const std::string& value,
                  const std::vector<std::string>& choices) const {
    if (std::find(choices.begin(), choices.end(), value) != choices.end()) {
      return;
    }
    std::string list;
    for (const std::string& choice : choices) {
      list += (list.empty() ? "" : ", ") + choice;
    }
    throw std::invalid_argument(prefix_ + key + ": '" + value + "' is not one of: " + list);
  }
  void operator()(const char* key, const std::string& name) const {
    if (!is_model_name(name)) {
      throw std::invalid_argument(prefix_ + key + ": '" + name + "' is not made of " +
                                  kModelNameRule);
    }
  }

 private:
  std::string prefix_;
};

}  // namespace

std::filesystem::path default_model_dir() {
  const char* from_environment = std::getenv("TOPOLOC_MODELS");
  if (from_environment != nullptr && *from_environment != '\0') {
    return from_environment;
  }
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", none);
  const auto installed = program.parent_path().parent_path() / "share" / "topoloc" / "models";
  if (std::filesystem::is_directory(installed, none)) {
    return installed;
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

bool is_model_name(const std::string& name) {
  return !name.empty() &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") == std::string::npos;
}

void validate(const MatchingConfig& config) {
  visit_matching_keys(config, KeyCheck("matching."));
  visit_guided_keys(config.guided, KeyCheck("matching.guided."));
  visit_outlier_keys(config.outliers, KeyCheck("matching.outliers."));
}

}  // namespace topoloc::matching
