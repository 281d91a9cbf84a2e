// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map/file_assembler.hpp"

#include "topoloc/map/types.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace topoloc::map {

std::uint64_t head_checksum(std::span<const std::byte> head) {
  return Checksum()
      .update(head.first(offsetof(format::Header, checksum)))
      .update(head.subspan(sizeof(format::Header), format::kHeadSize - sizeof(format::Header)))
      .value();
}

FileAssembler::FileAssembler(const std::filesystem::path& path) : file_(path) {
  const std::array<std::byte, format::kHeadSize> placeholder{};
  file_.append(placeholder);
}

void FileAssembler::begin_section(std::string_view name, std::uint32_t version, bool required) {
  format::SectionEntry& entry = entries_.emplace_back();
  std::copy_n(name.begin(), entry.name.size(), entry.name.begin());
  entry.version = version;
  entry.flags = required ? format::kRequired : 0;
  entry.offset = file_.size();
  checksum_.emplace();
}

void FileAssembler::append(std::span<const std::byte> bytes) {
  file_.append(bytes);
  checksum_->update(bytes);
}

void FileAssembler::end_section() {
  format::SectionEntry& entry = entries_.back();
  entry.length = file_.size() - entry.offset;
  const std::array<std::byte, format::kAlignment> zeros{};
  append(std::span(zeros).first(format::aligned(entry.length) - entry.length));
  entry.checksum = checksum_->value();
  checksum_.reset();
}

void FileAssembler::finish() {
  format::Header header;
  header.section_count = static_cast<std::uint32_t>(entries_.size());
  header.file_size = file_.size();

  std::vector<std::byte> head(format::kHeadSize);
  std::memcpy(head.data(), &header, sizeof(header));
  std::memcpy(head.data() + sizeof(header), entries_.data(),
              entries_.size() * sizeof(format::SectionEntry));
  header.checksum = head_checksum(head);
  std::memcpy(head.data(), &header, sizeof(header));
  file_.overwrite(0, head);
  file_.commit();
}

}  // namespace topoloc::map
