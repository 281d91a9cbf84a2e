// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/lzf.hpp"
#include "mapping/record_stream.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>

// PCD, version 0.7: a text header of KEY VALUES lines up to DATA, then the points. VIEWPOINT (where
// the scanner stood) is not applied to the points, as in PCL.
namespace topoloc::mapping {
namespace {

constexpr std::uint64_t kMaxValuesPerField = 4096;

struct PcdHeader {
  RecordLayout layout;
  std::uint64_t points = 0;
  std::string data;  // ascii, binary, binary_compressed
  std::uint64_t lines = 0;
};

using HeaderLines = std::map<std::string, std::vector<std::string>>;

Scalar scalar_type(const std::filesystem::path& path, const std::string& type,
                   const std::string& size) {
  static const std::map<std::string, Scalar> kTypes{
      {"I1", Scalar::kInt8},   {"U1", Scalar::kUint8},  {"I2", Scalar::kInt16},
      {"U2", Scalar::kUint16}, {"I4", Scalar::kInt32},  {"U4", Scalar::kUint32},
      {"I8", Scalar::kInt64},  {"U8", Scalar::kUint64}, {"F4", Scalar::kFloat32},
      {"F8", Scalar::kFloat64}};
  const auto it = kTypes.find(type + size);
  if (it == kTypes.end()) {
    fail(path, "PCD header: no type '" + type + "' of SIZE '" + size + "'");
  }
  return it->second;
}

HeaderLines read_header_lines(const std::filesystem::path& path, std::istream& stream,
                              std::uint64_t& line_count) {
  HeaderLines lines;
  std::string line;
  while (!lines.contains("DATA")) {
    if (line_count > 100 || !std::getline(stream, line) || line.size() > 100'000) {
      fail(path, "not a PCD file: no DATA line in its header");
    }
    ++line_count;
    std::vector<std::string> words = split_words(line);
    if (words.empty() || words[0].starts_with('#')) {
      continue;
    }
    const std::string key = words[0];
    words.erase(words.begin());
    lines[key] = words;
  }
  return lines;
}

PcdHeader read_pcd_header(const std::filesystem::path& path, std::istream& stream) {
  PcdHeader header;
  const HeaderLines lines = read_header_lines(path, stream, header.lines);
  const auto line = [&](const std::string& key, std::size_t words) {
    const auto it = lines.find(key);
    if (it == lines.end() || it->second.empty() || (words > 0 && it->second.size() != words)) {
      fail(path, "PCD header: " + key + " is missing or has the wrong number of values");
    }
    return it->second;
  };
  const auto fields = line("FIELDS", 0);
  const auto sizes = line("SIZE", fields.size());
  const auto types = line("TYPE", fields.size());
  const auto counts = lines.contains("COUNT") ? line("COUNT", fields.size())
                                              : std::vector<std::string>(fields.size(), "1");
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::uint64_t count = parse_count(path, counts[i], "PCD header: COUNT");
    if (count < 1 || count > kMaxValuesPerField) {
      fail(path, "PCD header: COUNT " + counts[i] + " is out of range (1 to 4096)");
    }
    header.layout.add(fields[i], scalar_type(path, types[i], sizes[i]), count);
  }
  header.points = parse_count(path, line("POINTS", 1)[0], "PCD header: POINTS");
  header.data = line("DATA", 1)[0];
  return header;
}

/// One field of the points of a compressed file: a column, read by a decompressor of its own.
class Column {
 public:
  Column(const std::filesystem::path& path, const Field& field) : path_(path), field_(field) {}
  /// `at`, `compressed`: the block in the file; `points`: how many values the column has.
  void open(std::streamoff at, std::uint64_t compressed, std::uint64_t points) {
    stream_.open(path_, std::ios::binary);
    stream_.seekg(at);
    reader_.emplace(stream_, compressed);
    check(reader_->skip(field_.offset * points));
  }
  void read(std::size_t points) {
    values_.resize(points * stride());
    check(reader_->read(values_));
  }
  [[nodiscard]] double value(std::size_t i) const {
    return load_scalar(field_.type, values_.data() + i * stride());
  }
  [[nodiscard]] std::size_t stride() const { return size_of(field_.type) * field_.count; }

 private:
  void check(bool ok) const {
    if (!ok) {
      fail(path_, "compressed data is corrupt");
    }
  }

  std::filesystem::path path_;
  Field field_;
  std::ifstream stream_;
  std::optional<LzfReader> reader_;
  std::vector<std::byte> values_;
};

/// binary_compressed: two uint32 sizes, then one LZF block that holds field after field. The fields
/// of a point are far apart, so each is decompressed on its own up to where it lies.
void read_compressed(const std::filesystem::path& path, std::istream& stream,
                     const PcdHeader& header, PointSink& sink, const Progress& progress) {
  std::array<std::uint32_t, 2> sizes{};  // compressed, uncompressed
  if (!stream.read(reinterpret_cast<char*>(sizes.data()), sizeof(sizes))) {
    fail(path, "truncated: ends before its compressed data");
  }
  const std::uint64_t available = bytes_left(stream);
  if (sizes[0] > available) {
    fail(path, "truncated: " + std::to_string(sizes[0]) + " compressed bytes announced, " +
                   std::to_string(available) + " there");
  }
  // LZF cannot do better than 264 bytes out of 3.
  if (sizes[1] / 88 > sizes[0] || sizes[1] % header.layout.record_size() != 0 ||
      sizes[1] / header.layout.record_size() != header.points) {
    fail(path, "compressed data of " + std::to_string(sizes[1]) + " bytes does not fit POINTS " +
                   std::to_string(header.points));
  }
  const auto fields = point_fields(header.layout);
  if (!fields) {
    fail(path, "points have no x, y and z");
  }
  const std::streamoff begin = stream.tellg();
  LzfReader whole(stream, sizes[0]);
  if (!whole.skip(sizes[1]) || !whole.at_end()) {
    fail(path, "compressed data is corrupt");
  }
  sink.info().has_intensity = fields->intensity.has_value();
  sink.expect(header.points);
  std::vector<Column> columns;
  for (const Field& field : {fields->x, fields->y, fields->z}) {
    columns.emplace_back(path, field);
  }
  if (fields->intensity) {
    columns.emplace_back(path, *fields->intensity);
  }
  std::size_t widest = 0;
  for (Column& column : columns) {
    column.open(begin, sizes[0], header.points);
    widest = std::max(widest, column.stride());
  }
  constexpr std::size_t kBlockBytes = 1 << 18;
  const std::size_t per_block = std::max<std::size_t>(1, kBlockBytes / widest);
  const ProgressTicker ticker(progress, header.points);
  for (std::uint64_t i = 0; i < header.points; i += per_block) {
    const auto here =
        static_cast<std::size_t>(std::min<std::uint64_t>(per_block, header.points - i));
    for (Column& column : columns) {
      column.read(here);
    }
    for (std::size_t k = 0; k < here; ++k) {
      sink.add({columns[0].value(k), columns[1].value(k), columns[2].value(k)},
               columns.size() > 3 ? static_cast<float>(columns[3].value(k)) : 0.0F);
      ticker.at(i + k);
    }
  }
}

}  // namespace

void read_pcd(const std::filesystem::path& path, PointSink& sink, const Progress& progress) {
  std::ifstream stream(path, std::ios::binary);
  const PcdHeader header = read_pcd_header(path, stream);
  const Records records{header.layout, header.points};
  if (header.points == 0) {
    fail(path, "holds no point");
  }
  if (header.data == "ascii") {
    read_ascii_points(path, stream, records, header.lines + 1, sink, progress);
  } else if (header.data == "binary") {
    read_binary_points(path, stream, records, false, sink, progress);
  } else if (header.data == "binary_compressed") {
    read_compressed(path, stream, header, sink, progress);
  } else {
    fail(path,
         "PCD header: DATA '" + header.data + "' is none of ascii, binary, binary_compressed");
  }
}

}  // namespace topoloc::mapping
