// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace topoloc::map {

/// A file that appears under its name only once it is complete and on disk: written to a temporary
/// file in the same folder, then fsync, rename, fsync of the folder. The destructor removes the
/// temporary file. All members throw MapError; after a failed write only destruction makes sense.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void append(std::span<const std::byte> bytes);
  /// Writes over bytes that have been appended before.
  void overwrite(std::uint64_t offset, std::span<const std::byte> bytes);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  void commit();

 private:
  void write(std::uint64_t offset, std::span<const std::byte> bytes);

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  bool failed_ = false;
};

/// A nameless temporary file in a folder: bytes go in, and later come out again from the start.
class SpoolFile {
 public:
  /// In the folder of `beside`, which also names it in errors.
  explicit SpoolFile(const std::filesystem::path& beside);
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  void append(std::span<const std::byte> bytes);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Reads exactly bytes.size() bytes at an offset.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path beside_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace topoloc::map
