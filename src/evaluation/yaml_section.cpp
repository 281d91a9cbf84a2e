// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "yaml_section.hpp"

#include <sstream>
#include <stdexcept>

namespace topoloc::evaluation {
namespace {

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

std::string key_line(std::size_t indent, const std::string& key, const std::string& value) {
  std::string line(indent, ' ');
  return line.append(key).append(": ").append(value);
}

}  // namespace

std::string with_values(const std::string& yaml, const std::string& section_name,
                        const std::vector<std::pair<std::string, std::string>>& values) {
  std::vector<std::string> lines = lines_of(yaml);
  std::size_t section = 0;
  while (section < lines.size() && !lines[section].starts_with(section_name + ":")) {
    ++section;
  }
  if (section == lines.size()) {
    lines.emplace_back(section_name + ":");
  }
  const std::size_t content = lines[section].find_first_not_of(" \r", section_name.size() + 1);
  if (content != std::string::npos && lines[section][content] != '#') {
    throw std::runtime_error("the section '" + section_name +
                             ":' is not in block style (a line per key)");
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
      lines[i] = key_line(indent, key, value).append(comment_of(old));
      found = true;
    }
    if (!found) {
      missing.push_back(key_line(2, key, value));
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
