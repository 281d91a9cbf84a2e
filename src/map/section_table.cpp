// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map/section_table.hpp"

#include "map/checksum.hpp"
#include "map/file_assembler.hpp"
#include "map/format.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace topoloc::map {
namespace {

constexpr std::array kKnown{format::kFeatures,     format::kInfo,   format::kNodes,
                            format::kImageEntries, format::kImages, format::kLidarEntries,
                            format::kLidarImages,  format::kReport};

/// Names of damaged or foreign sections must not garble the terminal.
std::string printable(const std::array<char, 4>& name) {
  std::string s(name.begin(), name.end());
  std::replace_if(
      s.begin(), s.end(), [](char c) { return c < 0x21 || c > 0x7e; }, '?');
  return s;
}

format::Header read_header(const std::string& file, std::span<const std::byte> bytes) {
  format::Header header;
  if (bytes.size() < format::kHeadSize) {
    throw MapError(file + ": " + std::to_string(bytes.size()) +
                   " bytes, too short for a map (its head alone has " +
                   std::to_string(format::kHeadSize) + ")");
  }
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.magic != format::kMagic) {
    throw MapError(file + ": not a topoloc map (wrong first eight bytes)");
  }
  if (header.format_version != format::kFormatVersion) {
    throw MapError(file + ": map format version " + std::to_string(header.format_version) +
                   ", this program reads version " + std::to_string(format::kFormatVersion));
  }
  if (head_checksum(bytes.first(format::kHeadSize)) != header.checksum) {
    throw MapError(file + ": head (bytes 0 to 4095) is damaged: wrong checksum");
  }
  if (header.file_size != bytes.size()) {
    throw MapError(file + ": " + std::to_string(bytes.size()) + " bytes, but its header says " +
                   std::to_string(header.file_size) +
                   (bytes.size() < header.file_size ? ": truncated" : ""));
  }
  if (header.section_count > format::kMaxSections) {
    throw MapError(file + ": " + std::to_string(header.section_count) + " sections, at most " +
                   std::to_string(format::kMaxSections));
  }
  return header;
}

}  // namespace

std::vector<SectionInfo> read_section_table(const std::string& file,
                                            std::span<const std::byte> bytes) {
  const format::Header header = read_header(file, bytes);
  std::vector<SectionInfo> sections;
  std::uint64_t end = format::kHeadSize;
  for (std::uint32_t i = 0; i < header.section_count; ++i) {
    format::SectionEntry entry;
    std::memcpy(&entry, bytes.data() + sizeof(header) + i * sizeof(entry), sizeof(entry));
    SectionInfo section;
    section.name = printable(entry.name);
    section.version = entry.version;
    section.required = (entry.flags & format::kRequired) != 0;
    section.known = entry.version == format::kSectionVersion &&
                    std::find(kKnown.begin(), kKnown.end(), section.name) != kKnown.end();
    section.offset = entry.offset;
    section.length = entry.length;
    section.checksum = entry.checksum;

    const std::string where = file + ": section " + section.name;
    if (!std::equal(entry.name.begin(), entry.name.end(), section.name.begin())) {
      throw MapError(where + " has a name that is not printable");
    }
    if (entry.offset != end) {
      throw MapError(where + " begins at byte " + std::to_string(entry.offset) + ", expected " +
                     std::to_string(end) + " (sections follow one another)");
    }
    // In this order nothing can overflow: the length is bounded before it is rounded up.
    const std::uint64_t room = bytes.size() - end;
    if (entry.length > room || format::aligned(entry.length) > room) {
      throw MapError(where + " of " + std::to_string(entry.length) +
                     " bytes does not fit into the " + std::to_string(room) +
                     " bytes left in the file");
    }
    section.extent = format::aligned(entry.length);
    end += section.extent;

    if (section.required && !section.known) {
      throw MapError(where + " version " + std::to_string(section.version) +
                     " is required to read this map and not known to this program: a newer "
                     "topoloc made the map");
    }
    if (std::any_of(sections.begin(), sections.end(),
                    [&](const SectionInfo& other) { return other.name == section.name; })) {
      throw MapError(where + " appears twice");
    }
    sections.push_back(std::move(section));
  }
  if (end != bytes.size()) {
    throw MapError(file + ": sections end at byte " + std::to_string(end) + ", the file at " +
                   std::to_string(bytes.size()));
  }
  return sections;
}

const SectionInfo* find_section(const std::vector<SectionInfo>& sections, std::string_view name) {
  const auto found = std::find_if(sections.begin(), sections.end(), [name](const SectionInfo& s) {
    return s.known && s.name == name;
  });
  return found == sections.end() ? nullptr : &*found;
}

void check_checksum(const std::string& file, std::span<const std::byte> bytes,
                    const SectionInfo& section) {
  if (checksum_of(bytes.subspan(section.offset, section.extent)) != section.checksum) {
    throw MapError(
        file + ": section " + section.name + " (bytes " + std::to_string(section.offset) + " to " +
        std::to_string(section.offset + section.extent - 1) + ") is damaged: wrong checksum");
  }
}

}  // namespace topoloc::map
