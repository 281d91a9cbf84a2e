// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/relocated.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace topoloc::config {
namespace {

namespace fs = std::filesystem;

/// The keys that hold paths (those that sections.hpp's functions resolve).
constexpr std::pair<const char*, const char*> kPathKeys[] = {{"can", "dbc"},
                                                             {"camera", "calibration"},
                                                             {"camera", "mask"},
                                                             {"imu", "calibration"},
                                                             {"matching", "model_dir"}};

struct PathScalar {
  std::size_t position;  ///< in the text
  std::string value;
};

/// All paths in the file, the last one first.
std::vector<PathScalar> path_scalars(const YAML::Node& top) {
  std::vector<PathScalar> scalars;
  const auto add = [&scalars](const YAML::Node& node) {
    scalars.push_back({static_cast<std::size_t>(node.Mark().pos), node.Scalar()});
  };
  for (const auto& [section, key] : kPathKeys) {
    if (!top.IsMap() || !top[section] || !top[section].IsMap() || !top[section][key]) {
      continue;
    }
    const YAML::Node value = top[section][key];
    if (value.IsScalar()) {
      add(value);
    } else if (value.IsSequence()) {
      std::for_each(value.begin(), value.end(), add);
    }
  }
  std::sort(scalars.begin(), scalars.end(),
            [](const PathScalar& a, const PathScalar& b) { return a.position > b.position; });
  return scalars;
}

std::string path_from(const fs::path& folder, const fs::path& file) {
  const bool share_a_folder = std::distance(folder.begin(), folder.end()) > 1 &&
                              *std::next(folder.begin()) == *std::next(file.begin());
  return (share_a_folder ? file.lexically_relative(folder) : file).string();
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    result += c == '"' || c == '\\' ? "\\" : "";
    result += c;
  }
  return result + "\"";
}

/// How long a scalar is in the file, its quotes included.
std::size_t written_length(const std::string& text, std::size_t position,
                           const std::string& value) {
  const char first = position < text.size() ? text[position] : '\0';
  const bool in_quotes = first == '"' || first == '\'';
  // An escaped character in quotes would make the value differ from what is written.
  const std::string written = in_quotes ? first + value + first : value;
  if (text.compare(position, written.size(), written) != 0) {
    throw std::runtime_error("write the path '" + value + "' on one line and without escapes");
  }
  return written.size();
}

}  // namespace

std::string relocated(const std::string& vehicle_yaml, const std::filesystem::path& from,
                      const std::filesystem::path& to) {
  const fs::path old_folder = fs::weakly_canonical(fs::absolute(from));
  const fs::path new_folder = fs::weakly_canonical(fs::absolute(to));
  if (old_folder == new_folder) {
    return vehicle_yaml;
  }
  std::string text = vehicle_yaml;
  // From the end, so that the positions of those before stay.
  for (const auto& [position, value] : path_scalars(YAML::Load(text))) {
    if (value.empty() || fs::path(value).is_absolute()) {
      continue;
    }
    const fs::path file = fs::weakly_canonical(old_folder / value);
    text.replace(position, written_length(text, position, value),
                 quoted(path_from(new_folder, file)));
  }
  return text;
}

}  // namespace topoloc::config
