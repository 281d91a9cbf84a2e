// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/map_file.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::map {

/// Checks the head of a map file and returns its sections, which then lie inside the file, aligned,
/// one after the other, without gaps. `file` names the file in errors. Throws MapError.
std::vector<SectionInfo> read_section_table(const std::string& file,
                                            std::span<const std::byte> bytes);

/// The section that this reader knows by that name, or nothing.
const SectionInfo* find_section(const std::vector<SectionInfo>& sections, std::string_view name);

/// A section's bytes without its padding.
inline std::span<const std::byte> content(std::span<const std::byte> file, const SectionInfo& s) {
  return file.subspan(s.offset, s.length);
}

/// Throws MapError unless a section, padding included, has its checksum.
void check_checksum(const std::string& file, std::span<const std::byte> bytes,
                    const SectionInfo& section);

}  // namespace topoloc::map
