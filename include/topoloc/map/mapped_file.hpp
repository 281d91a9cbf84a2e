// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace topoloc::map {

/// A file mapped into memory, read-only. Movable.
class MappedFile {
 public:
  /// Throws MapError where the file cannot be mapped, is empty, or not a regular file.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

  /// False once someone has written to the file, touched it or cut it short: pages that are not
  /// there any more end a process that reads them. One system call; between it and the reading a
  /// moment is left. (A file that is replaced, by mv, is not changed: the old one stays as long as
  /// it is mapped.)
  [[nodiscard]] bool unchanged() const;

 private:
  int fd_ = -1;
  std::span<const std::byte> bytes_;
  std::int64_t modified_ns_ = 0;
};

}  // namespace topoloc::map
