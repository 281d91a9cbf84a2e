// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "csv_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <zlib.h>

namespace topoloc::evaluation {
namespace {

/// Lines of a file that is plain or compressed with gzip (zlib reads both).
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& path)
      : path_(path), file_(gzopen(path.c_str(), "rb"), gzclose) {
    if (!file_ || std::filesystem::is_directory(path)) {
      throw std::runtime_error(path.string() + ": cannot open");
    }
  }

  /// Next line without its end; nothing at the end of the file.
  std::optional<std::string_view> next() {
    if (gzgets(file_.get(), buffer_.data(), static_cast<int>(buffer_.size())) == nullptr) {
      int code = Z_OK;
      const char* message = gzerror(file_.get(), &code);
      if (code != Z_OK && code != Z_STREAM_END) {
        fail(message);
      }
      return std::nullopt;
    }
    ++number_;
    std::string_view line(buffer_.data());
    if (line.size() == buffer_.size() - 1) {
      fail("line of more than " + std::to_string(line.size() - 1) + " characters");
    }
    while (line.ends_with('\n') || line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    return line;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw std::runtime_error(path_.string() + ":" + std::to_string(number_) + ": " + message);
  }

 private:
  std::filesystem::path path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
  std::array<char, 16384> buffer_{};
  std::size_t number_ = 0;
};

std::vector<std::string_view> comma_separated(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return fields;
}

template <typename Number>
Number parse(const LineReader& reader, std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() ||
      !std::isfinite(static_cast<double>(value))) {
    reader.fail("'" + std::string(text) + "' is not a finite number");
  }
  return value;
}

}  // namespace

std::vector<CsvRow> read_csv(const std::filesystem::path& path, const std::string& time_column,
                             const std::vector<std::string>& columns) {
  LineReader reader(path);
  const std::string header(reader.next().value_or(""));
  const std::vector<std::string_view> names = comma_separated(header);
  const auto index_of = [&](const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      reader.fail("no column '" + name + "'");
    }
    return static_cast<std::size_t>(found - names.begin());
  };
  const std::size_t time_index = index_of(time_column);
  std::vector<std::size_t> indices;
  std::transform(columns.begin(), columns.end(), std::back_inserter(indices), index_of);

  std::vector<CsvRow> rows;
  while (const auto line = reader.next()) {
    const auto fields = comma_separated(*line);
    if (fields.size() != names.size()) {
      reader.fail("found " + std::to_string(fields.size()) + " columns, expected " +
                  std::to_string(names.size()));
    }
    CsvRow row;
    row.time_ns = parse<std::int64_t>(reader, fields[time_index]);
    if (!rows.empty() && row.time_ns <= rows.back().time_ns) {
      reader.fail("time does not increase");
    }
    row.values.reserve(indices.size());
    for (const std::size_t index : indices) {
      row.values.push_back(parse<double>(reader, fields[index]));
    }
    rows.push_back(std::move(row));
  }
  if (rows.empty()) {
    throw std::runtime_error(path.string() + ": no rows");
  }
  return rows;
}

}  // namespace topoloc::evaluation
