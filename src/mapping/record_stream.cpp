// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/record_stream.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

namespace topoloc::mapping {
namespace {

PointFields require_point_fields(const std::filesystem::path& path, const RecordLayout& layout) {
  const auto fields = point_fields(layout);
  if (!fields) {
    std::string names;
    for (const Field& field : layout.fields()) {
      names += " " + field.name;
    }
    fail(path, "points have no x, y and z (fields:" + names + ")");
  }
  return *fields;
}

/// A number as writers of point clouds put it: also "nan", "-nan", "inf", "+1". False if it is
/// none.
bool parse_number(const std::string& word, double& value) {
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(begin, end, value);
  if (result.ec == std::errc::result_out_of_range) {
    value = std::numeric_limits<double>::infinity();  // counted as not finite later
    return true;
  }
  return result.ec == std::errc() && result.ptr == end;
}

}  // namespace

std::vector<std::string> split_words(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    words.push_back(word);
  }
  return words;
}

std::uint64_t parse_count(const std::filesystem::path& path, const std::string& word,
                          const std::string& what) {
  std::uint64_t value = 0;
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size()) {
    fail(path, what + " '" + word + "' is not a count");
  }
  return value;
}

std::uint64_t bytes_left(std::istream& stream) {
  const auto here = stream.tellg();
  stream.seekg(0, std::ios::end);
  const auto end = stream.tellg();
  stream.seekg(here);
  return static_cast<std::uint64_t>(end - here);
}

void read_ascii_points(const std::filesystem::path& path, std::istream& stream,
                       const Records& records, std::uint64_t first_line, PointSink& sink,
                       const Progress& progress) {
  const auto& [layout, count] = records;
  const PointFields fields = require_point_fields(path, layout);
  // A row takes at least a digit and a separator for each column.
  if (count > bytes_left(stream) / layout.column_count()) {
    fail(path, "announces " + std::to_string(count) + " points, more than the file can hold");
  }
  sink.info().has_intensity = fields.intensity.has_value();
  sink.expect(count);
  const ProgressTicker ticker(progress, count);
  std::string line;
  std::vector<double> row(layout.column_count());
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string where = "line " + std::to_string(first_line + i);
    if (!std::getline(stream, line)) {
      fail(path, where + ": file ends after " + std::to_string(i) + " of " + std::to_string(count) +
                     " points");
    }
    const std::vector<std::string> words = split_words(line);
    if (words.size() != row.size()) {
      fail(path, where + ": has " + std::to_string(words.size()) + " values, expected " +
                     std::to_string(row.size()));
    }
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (!parse_number(words[c], row[c])) {
        fail(path, where + ": '" + words[c] + "' is not a number");
      }
    }
    sink.add({row[fields.x.column], row[fields.y.column], row[fields.z.column]},
             fields.intensity ? static_cast<float>(row[fields.intensity->column]) : 0.0F);
    ticker.at(i);
  }
}

void read_binary_points(const std::filesystem::path& path, std::istream& stream,
                        const Records& records, bool swap_bytes, PointSink& sink,
                        const Progress& progress) {
  const auto& [layout, count] = records;
  const PointFields fields = require_point_fields(path, layout);
  const std::uint64_t available = bytes_left(stream) / layout.record_size();
  if (count > available) {
    fail(path, "announces " + std::to_string(count) + " points but holds " +
                   std::to_string(available) + ": truncated?");
  }
  sink.info().has_intensity = fields.intensity.has_value();
  sink.expect(count);
  const ProgressTicker ticker(progress, count);
  constexpr std::uint64_t kBlockBytes = 1 << 20;
  const std::uint64_t per_block = std::max<std::uint64_t>(1, kBlockBytes / layout.record_size());
  std::vector<std::byte> block(per_block * layout.record_size());
  for (std::uint64_t i = 0; i < count; i += per_block) {
    const std::uint64_t here = std::min(per_block, count - i);
    if (!stream.read(reinterpret_cast<char*>(block.data()),
                     static_cast<std::streamsize>(here * layout.record_size()))) {
      fail(path, "cannot be read past point " + std::to_string(i));
    }
    for (std::uint64_t k = 0; k < here; ++k) {
      const std::byte* record = block.data() + k * layout.record_size();
      const auto value = [&](const Field& field) {
        return load_scalar(field.type, record + field.offset, swap_bytes);
      };
      sink.add({value(fields.x), value(fields.y), value(fields.z)},
               fields.intensity ? static_cast<float>(value(*fields.intensity)) : 0.0F);
      ticker.at(i + k);
    }
  }
}

}  // namespace topoloc::mapping
