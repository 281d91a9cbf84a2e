// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/lzf.hpp"
#include "mapping/record_stream.hpp"

#include <cstring>
#include <fstream>
#include <map>

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

/// binary_compressed: two uint32 sizes, then one LZF block that holds field after field.
PointCloud read_compressed(const std::filesystem::path& path, std::istream& stream,
                           const PcdHeader& header, const Progress& progress) {
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
  std::vector<std::byte> compressed(sizes[0]);
  stream.read(reinterpret_cast<char*>(compressed.data()), sizes[0]);
  std::vector<std::byte> columns(sizes[1]);
  if (!stream || !lzf_decompress(compressed, columns)) {
    fail(path, "compressed data is corrupt");
  }
  const auto fields = point_fields(header.layout);
  if (!fields) {
    fail(path, "points have no x, y and z");
  }
  PointSink sink(fields->intensity.has_value(), header.points);
  const ProgressTicker ticker(progress, header.points);
  for (std::uint64_t i = 0; i < header.points; ++i) {
    const auto value = [&](const Field& field) {
      return load_scalar(field.type, columns.data() + field.offset * header.points +
                                         i * size_of(field.type) * field.count);
    };
    sink.add({value(fields->x), value(fields->y), value(fields->z)},
             fields->intensity ? static_cast<float>(value(*fields->intensity)) : 0.0F);
    ticker.at(i);
  }
  return std::move(sink.cloud());
}

}  // namespace

PointCloud read_pcd(const std::filesystem::path& path, const Progress& progress) {
  std::ifstream stream(path, std::ios::binary);
  const PcdHeader header = read_pcd_header(path, stream);
  if (header.points == 0) {
    fail(path, "holds no point");
  }
  if (header.data == "ascii") {
    return read_ascii_points(path, stream, header.layout, header.points, header.lines + 1,
                             progress);
  }
  if (header.data == "binary") {
    return read_binary_points(path, stream, header.layout, header.points, false, progress);
  }
  if (header.data == "binary_compressed") {
    return read_compressed(path, stream, header, progress);
  }
  fail(path, "PCD header: DATA '" + header.data + "' is none of ascii, binary, binary_compressed");
}

}  // namespace topoloc::mapping
