// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map/atomic_file.hpp"
#include "map/checksum.hpp"
#include "map/format.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace topoloc::map {

/// Puts a map file together section by section, with padding, checksums and section table.
class FileAssembler {
 public:
  explicit FileAssembler(const std::filesystem::path& path);

  void begin_section(std::string_view name, std::uint32_t version, bool required);
  void append(std::span<const std::byte> bytes);
  void end_section();
  /// Writes the head and commits the file.
  void finish();

 private:
  AtomicFile file_;
  std::vector<format::SectionEntry> entries_;
  std::optional<Checksum> checksum_;  ///< of the open section
};

/// Checksum of the head (header and section table), its own field left out.
std::uint64_t head_checksum(std::span<const std::byte> head);

}  // namespace topoloc::map
