// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/config_error.hpp"

#include <concepts>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace topoloc::config {

/// What a number may be. Open ends exclude the bound itself.
struct Range {
  double low;
  double high;
  bool low_open = false;
  bool operator()(double value) const {
    return (low_open ? value > low : value >= low) && value <= high;
  }
};
inline constexpr Range positive_up_to(double high) { return {0.0, high, true}; }

/// A YAML map that is read key by key and remembers which keys it was asked for, so that finish()
/// can name those that nobody knows. Every complaint is a ConfigError with file, line and key.
///
/// `read(key, target, ...)` leaves the default that is in `target` where the key is absent;
/// `require(key, target, ...)` complains.
class StrictNode {
 public:
  /// The top level of a YAML file.
  static StrictNode load(const std::filesystem::path& file);

  void read(const char* key, double& target, Range range);
  void read(const char* key, int& target, Range range);
  void read(const char* key, bool& target);
  void read(const char* key, std::string& target);
  void read(const char* key, std::string& target, const std::vector<std::string>& choices);
  void read(const char* key, std::vector<std::string>& target);
  /// A list of `count` numbers ("3" for a vector), or of any length from `min` to `max`.
  void read(const char* key, std::vector<double>& target, std::size_t min_count,
            std::size_t max_count, Range range);
  /// A fixed-size Eigen vector.
  template <typename Vector>
  requires(Vector::ColsAtCompileTime == 1) void read(const char* key, Vector& target, Range range) {
    constexpr auto n = static_cast<std::size_t>(Vector::RowsAtCompileTime);
    std::vector<double> values(target.data(), target.data() + n);
    read(key, values, n, n, range);
    for (std::size_t i = 0; i < n; ++i) target.data()[i] = values[i];
  }

  template <typename Target, typename... Args>
  void require(const char* key, Target& target, const Args&... args) {
    demand(key);
    read(key, target, args...);
  }

  /// A nested map; an absent one reads as empty, so that its defaults apply.
  StrictNode section(const char* key);
  StrictNode required_section(const char* key);
  bool has(const char* key);
  /// The raw value, for what needs its own reading; must be there.
  YAML::Node raw(const char* key);

  /// Throws if the map holds a key that was never asked for.
  void finish() const;

  /// ConfigError for a key of this map (its own line where it is there).
  [[nodiscard]] ConfigError error(const char* key, const std::string& what) const;
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] std::filesystem::path sibling(const std::string& name) const;

 private:
  StrictNode(YAML::Node node, std::filesystem::path file, std::string path, int line);
  std::optional<YAML::Node> find(const char* key);
  void demand(const char* key);
  double number(const char* key, const YAML::Node& value, const Range& range,
                const char* kind) const;
  [[nodiscard]] std::string full_key(std::string_view key) const;

  YAML::Node node_;  ///< undefined for an absent section
  std::filesystem::path file_;
  std::string path_;  ///< dotted path of this map, empty at the top
  int line_;
  std::vector<std::string> known_;
};

}  // namespace topoloc::config
