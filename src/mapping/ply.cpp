// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/record_stream.hpp"

#include <fstream>
#include <limits>
#include <map>

// PLY: a text header of elements and their properties up to end_header, then the elements in that
// order. Only the element `vertex` is read; what follows it (faces) is left alone.
namespace topoloc::mapping {
namespace {

struct Element {
  std::string name;
  std::uint64_t count = 0;
  RecordLayout layout;
  bool has_list = false;
};

struct PlyHeader {
  std::string format;
  std::vector<Element> elements;
  std::uint64_t lines = 0;
};

Scalar scalar_type(const std::filesystem::path& path, const std::string& name) {
  static const std::map<std::string, Scalar> kTypes{
      {"char", Scalar::kInt8},      {"int8", Scalar::kInt8},       {"uchar", Scalar::kUint8},
      {"uint8", Scalar::kUint8},    {"short", Scalar::kInt16},     {"int16", Scalar::kInt16},
      {"ushort", Scalar::kUint16},  {"uint16", Scalar::kUint16},   {"int", Scalar::kInt32},
      {"int32", Scalar::kInt32},    {"uint", Scalar::kUint32},     {"uint32", Scalar::kUint32},
      {"float", Scalar::kFloat32},  {"float32", Scalar::kFloat32}, {"double", Scalar::kFloat64},
      {"float64", Scalar::kFloat64}};
  const auto it = kTypes.find(name);
  if (it == kTypes.end()) {
    fail(path, "PLY header: unknown type '" + name + "'");
  }
  return it->second;
}

void read_property(const std::filesystem::path& path, const std::vector<std::string>& words,
                   PlyHeader& header) {
  if (header.elements.empty()) {
    fail(path, "PLY header: property before the first element");
  }
  Element& element = header.elements.back();
  if (words.size() == 5 && words[1] == "list") {
    element.has_list = true;
  } else if (words.size() == 3) {
    element.layout.add(words[2], scalar_type(path, words[1]));
  } else {
    fail(path, "PLY header: line " + std::to_string(header.lines) + " is not a property");
  }
}

PlyHeader read_ply_header(const std::filesystem::path& path, std::istream& stream) {
  PlyHeader header;
  std::string line;
  while (true) {
    if (header.lines > 10'000 || !std::getline(stream, line)) {
      fail(path, "PLY header: no end_header");
    }
    ++header.lines;
    const std::vector<std::string> words = split_words(line);
    if (header.lines == 1) {
      if (words != std::vector<std::string>{"ply"}) {
        fail(path, "not a PLY file: does not begin with 'ply'");
      }
    } else if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
      continue;
    } else if (words[0] == "format" && words.size() == 3) {
      header.format = words[1];
    } else if (words[0] == "element" && words.size() == 3) {
      header.elements.push_back(
          {words[1], parse_count(path, words[2], "PLY header: element " + words[1]), {}, false});
    } else if (words[0] == "property") {
      read_property(path, words, header);
    } else if (words[0] == "end_header") {
      return header;
    } else {
      fail(path, "PLY header: line " + std::to_string(header.lines) + " '" + words[0] +
                     "' is not understood");
    }
  }
}

}  // namespace

void read_ply(const std::filesystem::path& path, PointSink& sink, const Progress& progress) {
  std::ifstream stream(path, std::ios::binary);
  const PlyHeader header = read_ply_header(path, stream);
  const bool ascii = header.format == "ascii";
  if (!ascii && header.format != "binary_little_endian" && header.format != "binary_big_endian") {
    fail(path, "PLY header: format '" + header.format + "' is not known");
  }
  std::uint64_t line = header.lines + 1;
  for (const Element& element : header.elements) {
    if (element.has_list && (!ascii || element.name == "vertex")) {
      fail(path, "PLY element '" + element.name +
                     "' has a list before the end of the vertices: " + "not supported");
    }
    if (element.name != "vertex") {
      if (ascii) {
        for (std::uint64_t i = 0; i < element.count && stream; ++i) {
          stream.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
        }
        line += element.count;
      } else if (element.layout.record_size() > 0) {
        if (element.count > bytes_left(stream) / element.layout.record_size()) {
          fail(path, "truncated within element '" + element.name + "'");
        }
        stream.ignore(static_cast<std::streamsize>(element.count * element.layout.record_size()));
      }
      continue;
    }
    if (element.count == 0) {
      fail(path, "holds no point");
    }
    if (ascii) {
      read_ascii_points(path, stream, {element.layout, element.count}, line, sink, progress);
    } else {
      read_binary_points(path, stream, {element.layout, element.count},
                         header.format == "binary_big_endian", sink, progress);
    }
    return;
  }
  fail(path, "PLY header: no element 'vertex'");
}

}  // namespace topoloc::mapping
