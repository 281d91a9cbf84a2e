// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "config/strict_node.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

namespace topoloc::config {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 1U << 20U;

std::string location(const std::filesystem::path& file, int line) {
  return file.string() + ":" + std::to_string(line) + ": ";
}

std::string text_of(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%g", value);
  return buffer.data();
}

std::string text_of(const Range& range) {
  return (range.low_open ? "(" : "[") + text_of(range.low) + ", " + text_of(range.high) + "]";
}

std::string found(const YAML::Node& value) {
  switch (value.Type()) {
    case YAML::NodeType::Scalar:
      return "found '" + value.Scalar() + "'";
    case YAML::NodeType::Sequence:
      return "found a list";
    case YAML::NodeType::Map:
      return "found a map";
    default:
      return "found nothing";
  }
}

std::string joined(const std::vector<std::string>& words) {
  std::string result;
  for (const std::string& word : words) {
    result += (result.empty() ? "" : ", ") + word;
  }
  return result;
}

}  // namespace

StrictNode::StrictNode(const YAML::Node& node, std::filesystem::path file, std::string path,
                       int line)
    : node_(node), file_(std::move(file)), path_(std::move(path)), line_(line) {
  if (!node_.IsMap() && !node_.IsNull()) {
    throw ConfigError(location(file_, line_) + (path_.empty() ? "" : path_ + ": ") +
                      "expected a map of keys, " + found(node_));
  }
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) {
      throw ConfigError(location(file_, entry.first.Mark().line + 1) + "a key must be a word");
    }
    if (!seen.insert(entry.first.Scalar()).second) {
      throw ConfigError(location(file_, entry.first.Mark().line + 1) +
                        (path_.empty() ? "" : path_ + ".") + entry.first.Scalar() +
                        ": the key is there twice");
    }
  }
}

StrictNode StrictNode::load(const std::filesystem::path& file) {
  std::error_code failure;
  const std::uintmax_t size = std::filesystem::file_size(file, failure);
  if (failure) {
    throw ConfigError(file.string() + ": cannot be read: " + failure.message());
  }
  if (size > kMaxFileBytes) {
    throw ConfigError(file.string() + ": longer than any configuration (1 MiB)");
  }
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) {
    throw ConfigError(file.string() + ": cannot be read");
  }
  try {
    return {YAML::Load(text.str()), file, "", 1};
  } catch (const YAML::Exception& error) {
    throw ConfigError(location(file, error.mark.line + 1) + "not YAML: " + error.msg);
  }
}

YAML::Node StrictNode::find(const std::string& key) const {
  // Not node_[key]: on a null node that is an error, and on a map it may add the key.
  for (const auto& entry : node_) {
    if (entry.first.Scalar() == key) {
      return entry.second;
    }
  }
  return YAML::Node(YAML::NodeType::Null);
}

YAML::Node StrictNode::ask(const char* key) {
  if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) {
    asked_.emplace_back(key);
  }
  return find(key);
}

bool StrictNode::has(const char* key) { return !ask(key).IsNull(); }

void StrictNode::demand(const char* key) {
  if (!has(key)) {
    throw error(key, "missing");
  }
}

ConfigError StrictNode::error(const std::string& key, const std::string& what) const {
  return ConfigError(place(key) + ": " + what);
}

std::string StrictNode::place(const std::string& key) const {
  int line = line_;
  for (const auto& entry : node_) {
    if (entry.first.Scalar() == key) {
      line = entry.first.Mark().line + 1;
    }
  }
  return location(file_, line) + (path_.empty() ? "" : path_ + ".") + key;
}

std::filesystem::path StrictNode::resolve(const std::string& path) const {
  return file_.parent_path() / path;
}

double StrictNode::number(const char* key, const YAML::Node& value, const Range& range,
                          const char* kind) const {
  double result = 0.0;
  if (!value.IsScalar() || !YAML::convert<double>::decode(value, result) ||
      !range.contains(result)) {
    throw error(key,
                std::string("expected ") + kind + " in " + text_of(range) + ", " + found(value));
  }
  return result;
}

void StrictNode::check_default(const char* key, double value, const Range& range) const {
  if (!range.contains(value)) {
    throw error(key, "expected a number in " + text_of(range) +
                         ", found none, and the default is " + text_of(value));
  }
}

void StrictNode::read(const char* key, double& target, Range range) {
  if (const YAML::Node value = ask(key); !value.IsNull()) {
    target = number(key, value, range, "a number");
  } else {
    check_default(key, target, range);
  }
}

void StrictNode::read(const char* key, int& target, Range range) {
  if (const YAML::Node value = ask(key); !value.IsNull()) {
    const double result = number(key, value, range, "a whole number");
    if (result != std::floor(result)) {
      throw error(key, "expected a whole number in " + text_of(range) + ", " + found(value));
    }
    target = static_cast<int>(result);
  } else {
    check_default(key, target, range);
  }
}

void StrictNode::read(const char* key, bool& target) {
  if (const YAML::Node value = ask(key); !value.IsNull()) {
    if (!value.IsScalar() || !YAML::convert<bool>::decode(value, target)) {
      throw error(key, "expected true or false, " + found(value));
    }
  }
}

void StrictNode::read(const char* key, std::string& target) {
  if (const YAML::Node value = ask(key); !value.IsNull()) {
    if (!value.IsScalar() || value.Scalar().empty()) {
      throw error(key, "expected text, " + found(value));
    }
    target = value.Scalar();
  }
}

void StrictNode::read_or_none(const char* key, std::string& target) {
  if (const YAML::Node value = ask(key); value.IsScalar() && value.Scalar().empty()) {
    target.clear();
  } else {
    read(key, target);
  }
}

void StrictNode::read(const char* key, std::string& target,
                      const std::vector<std::string>& choices) {
  if (const YAML::Node value = ask(key); !value.IsNull()) {
    if (!value.IsScalar() ||
        std::find(choices.begin(), choices.end(), value.Scalar()) == choices.end()) {
      throw error(key, "expected one of " + joined(choices) + ", " + found(value));
    }
    target = value.Scalar();
  }
}

void StrictNode::read(const char* key, std::vector<std::string>& target) {
  const YAML::Node value = ask(key);
  if (value.IsNull()) {
    return;
  }
  if (!value.IsSequence()) {
    throw error(key, "expected a list of words, " + found(value));
  }
  target.clear();
  for (const YAML::Node& item : value) {
    if (!item.IsScalar() || item.Scalar().empty()) {
      throw error(key, "expected a list of words, in it " + found(item));
    }
    target.push_back(item.Scalar());
  }
}

void StrictNode::read(const char* key, std::vector<double>& target, std::size_t min_count,
                      std::size_t max_count, Range range) {
  const YAML::Node value = ask(key);
  if (value.IsNull()) {
    return;
  }
  if (!value.IsSequence() || value.size() < min_count || value.size() > max_count) {
    const std::string count = min_count == max_count
                                  ? std::to_string(min_count)
                                  : std::to_string(min_count) + " to " + std::to_string(max_count);
    throw error(key, "expected a list of " + count + " numbers, " + found(value) +
                         (value.IsSequence() ? " of " + std::to_string(value.size()) : ""));
  }
  target.clear();
  for (const YAML::Node& item : value) {
    target.push_back(number(key, item, range, "numbers"));
  }
}

void StrictNode::require_one_or_more(const char* key, std::vector<std::string>& target) {
  demand(key);
  if (const YAML::Node value = ask(key); value.IsScalar()) {
    target.assign(1, "");
    read(key, target.front());
    return;
  }
  read(key, target);
  if (target.empty()) {
    throw error(key, "expected at least one");
  }
}

std::vector<std::vector<double>> StrictNode::require_rows(const char* key, std::size_t rows,
                                                          std::size_t columns) {
  demand(key);
  const YAML::Node value = ask(key);
  const std::string expected = "expected " + std::to_string(rows) + " rows of " +
                               std::to_string(columns) + " finite numbers, ";
  if (!value.IsSequence() || value.size() != rows) {
    throw error(key, expected + found(value));
  }
  std::vector<std::vector<double>> result;
  for (const YAML::Node& row : value) {
    if (!row.IsSequence() || row.size() != columns) {
      throw error(key, expected + "in it " + found(row));
    }
    std::vector<double>& numbers = result.emplace_back();
    for (const YAML::Node& item : row) {
      numbers.push_back(number(key, item, {-1e9, 1e9}, "numbers"));
    }
  }
  return result;
}

StrictNode StrictNode::section(const char* key) {
  const YAML::Node value = ask(key);
  return {value, file_, (path_.empty() ? "" : path_ + ".") + key,
          value.IsNull() ? line_ : value.Mark().line + 1};
}

StrictNode StrictNode::required_section(const char* key) {
  demand(key);
  return section(key);
}

std::vector<StrictNode> StrictNode::items(const char* key) {
  const YAML::Node value = ask(key);
  std::vector<StrictNode> result;
  if (value.IsNull()) {
    return result;
  }
  if (!value.IsSequence()) {
    throw error(key, "expected a list of maps, " + found(value));
  }
  const std::string path = (path_.empty() ? "" : path_ + ".") + key;
  for (const YAML::Node& item : value) {
    result.push_back(
        {item, file_, path + "[" + std::to_string(result.size()) + "]", item.Mark().line + 1});
  }
  return result;
}

void StrictNode::finish() const {
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) {
      throw error(key, "unknown key (known here: " + joined(asked_) + ")");
    }
  }
}

}  // namespace topoloc::config
