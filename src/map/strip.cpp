// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"

#include "map/file_assembler.hpp"
#include "map/format.hpp"
#include "map/section_table.hpp"

#include <algorithm>
#include <array>

namespace topoloc::map {
namespace {

/// All that only people look at, except for the report: it is small and tells what to drive on.
constexpr std::array kDropped{format::kImageEntries, format::kImages, format::kLidarEntries,
                              format::kLidarImages};

}  // namespace

void strip(const std::filesystem::path& in, const std::filesystem::path& out) {
  const MapFile map(in);
  FileAssembler file(out);
  for (const SectionInfo& section : map.sections()) {
    if (std::find(kDropped.begin(), kDropped.end(), section.name) != kDropped.end()) {
      continue;
    }
    // What is copied is checked: damage must not get a fresh checksum.
    check_checksum(in.string(), map.bytes(), section);
    file.begin_section(section.name, section.version, section.required);
    file.append(content(map.bytes(), section));
    file.end_section();
  }
  file.finish();
}

}  // namespace topoloc::map
