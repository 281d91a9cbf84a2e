// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/mounting.hpp"

#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace topoloc::evaluation {
namespace {

std::string list(const Eigen::Vector3d& v, const char* pattern) {
  char text[128];
  std::snprintf(text, sizeof text, pattern, v.x(), v.y(), v.z());
  return text;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5f", value);
  return text;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

bool continues_section(const std::string& line) {
  return line.empty() || line[0] == ' ' || line[0] == '#' || line[0] == '\r';
}

/// "  # like this" at the end of a line, with the blanks before it.
std::string comment_of(const std::string& line) {
  const std::size_t hash = line.find(" #");
  return hash == std::string::npos ? "" : " " + line.substr(hash);
}

}  // namespace

std::string with_mounting(const std::string& vehicle_yaml, const Mounting& mounting) {
  const std::vector<std::pair<std::string, std::string>> values = {
      {"rotation_vehicle_imu_rpy_rad",
       list(mounting.rotation_vehicle_imu_rpy_rad, "[%.6f, %.6f, %.6f]")},
      {"wheel_reference_imu_m", list(mounting.wheel_reference_imu_m, "[%.4f, %.4f, %.4f]")},
      {"wheel_scale", number(mounting.wheel_scale)},
  };
  std::vector<std::string> lines = lines_of(vehicle_yaml);
  std::size_t section = 0;
  while (section < lines.size() && !lines[section].starts_with("vehicle:")) {
    ++section;
  }
  if (section == lines.size()) {
    lines.emplace_back("vehicle:");
  }
  const std::size_t content =
      lines[section].find_first_not_of(" \r", std::string("vehicle:").size());
  if (content != std::string::npos && lines[section][content] != '#') {
    throw std::runtime_error("the section 'vehicle:' is not in block style (a line per key)");
  }
  std::size_t end = section + 1;
  while (end < lines.size() && continues_section(lines[end])) {
    ++end;
  }
  std::vector<std::string> missing;
  for (const auto& [key, value] : values) {
    bool found = false;
    for (std::size_t i = section + 1; i < end && !found; ++i) {
      const std::size_t indent = lines[i].find_first_not_of(' ');
      if (indent == std::string::npos || lines[i].compare(indent, key.size() + 1, key + ":") != 0) {
        continue;
      }
      const std::string old = lines[i].substr(indent + key.size() + 1);
      const std::size_t begin = old.find_first_not_of(" \r");
      const bool open_list =
          old.find('[') != std::string::npos && old.find(']') == std::string::npos;
      if (begin == std::string::npos || old[begin] == '#' || open_list) {
        throw std::runtime_error("line " + std::to_string(i + 1) + ": write '" + key +
                                 "' and its value on one line");
      }
      lines[i] = std::string(indent, ' ') + key + ": " + value + comment_of(old);
      found = true;
    }
    if (!found) {
      missing.push_back("  " + key + ": " + value);
    }
  }
  lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(section) + 1, missing.begin(),
               missing.end());
  std::string text;
  for (const std::string& line : lines) {
    text += line + "\n";
  }
  return text;
}

}  // namespace topoloc::evaluation
