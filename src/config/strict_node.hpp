// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/config_error.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace topoloc::config {

/// Numbers from low to high, both allowed; `low_open`: low itself is not.
struct Range {
  double low;
  double high;
  bool low_open = false;

  [[nodiscard]] bool contains(double value) const {  // false for NaN
    return (low_open ? value > low : value >= low) && value <= high;
  }
};
constexpr Range positive_up_to(double high) { return {0.0, high, true}; }

/// A YAML map read key by key. It remembers what it was asked for, so that finish() can name the
/// keys that nobody knows. Every complaint is a ConfigError with file, line and key.
///
/// `read` leaves the default in `target` where the key is absent; `require` complains.
class StrictNode {
 public:
  /// The top level of a YAML file.
  static StrictNode load(const std::filesystem::path& file);

  void read(const char* key, double& target, Range range);
  void read(const char* key, int& target, Range range);
  void read(const char* key, bool& target);
  void read(const char* key, std::string& target);
  /// Text that may be empty: "" says none, which is not the default.
  void read_or_none(const char* key, std::string& target);
  void read(const char* key, std::string& target, const std::vector<std::string>& choices);
  void read(const char* key, std::vector<std::string>& target);
  /// A list of min_count to max_count numbers.
  void read(const char* key, std::vector<double>& target, std::size_t min_count,
            std::size_t max_count, Range range);

  template <typename Target, typename... Args>
  void require(const char* key, Target& target, const Args&... args) {
    demand(key);
    read(key, target, args...);
  }

  /// A required word, or a list of at least one.
  void require_one_or_more(const char* key, std::vector<std::string>& target);

  /// A nested map; an absent one reads as empty, so that its defaults apply.
  StrictNode section(const char* key);
  StrictNode required_section(const char* key);
  /// A list of maps; empty where the key is absent.
  std::vector<StrictNode> items(const char* key);
  /// Whether the key is there with a value; counts as asking for it.
  bool has(const char* key);
  /// A required list of rows of numbers, all of `columns`.
  std::vector<std::vector<double>> require_rows(const char* key, std::size_t rows,
                                                std::size_t columns);

  /// Throws if the map holds a key that was never asked for.
  void finish() const;

  /// A complaint about a key of this map, with its line (the map's own where the key is absent).
  [[nodiscard]] ConfigError error(const std::string& key, const std::string& what) const;
  /// How complaints about a key begin: "vehicle.yaml:12: section.key".
  [[nodiscard]] std::string place(const std::string& key) const;
  /// A path as written in the file, relative to the file's folder.
  [[nodiscard]] std::filesystem::path resolve(const std::string& path) const;

 private:
  StrictNode(const YAML::Node& node, std::filesystem::path file, std::string path, int line);
  YAML::Node find(const std::string& key) const;
  YAML::Node ask(const char* key);
  void demand(const char* key);
  double number(const char* key, const YAML::Node& value, const Range& range,
                const char* kind) const;
  /// Another key may have moved the bounds away from the default.
  void check_default(const char* key, double value, const Range& range) const;

  YAML::Node node_;
  std::filesystem::path file_;
  std::string path_;  ///< dotted key of this map, empty at the top
  int line_;
  std::vector<std::string> asked_;
};

}  // namespace topoloc::config
