// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace topoloc::mapping {

/// Read-only memory map of a file of ours that nobody else can change.
class FileMapping {
 public:
  /// `resident_bytes`: see about_to_read().
  FileMapping(int descriptor, std::size_t size, std::uint64_t resident_bytes);
  ~FileMapping();
  FileMapping(const FileMapping&) = delete;
  FileMapping& operator=(const FileMapping&) = delete;

  [[nodiscard]] std::span<const std::byte> bytes() const { return {data_, size_}; }

  /// Keeps the pages that this process holds of the file bounded: lets all of them go once the
  /// announced reads add up to `resident_bytes`. (They stay in the kernel's page cache as long as
  /// memory is not short, so taking them again is cheap.) May be called while others read.
  void about_to_read(std::uint64_t bytes) const;

 private:
  const std::byte* data_ = nullptr;
  std::size_t size_;
  std::uint64_t resident_bytes_;
  mutable std::atomic<std::uint64_t> read_ = 0;
};

/// A file without a name: it is gone as soon as nobody has it open or mapped, however the process
/// ends, so that nothing is left behind and nothing stale is ever met.
/// All members throw std::runtime_error with the folder, the reason, and what to do.
class ScratchFile {
 public:
  explicit ScratchFile(std::filesystem::path folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;
  /// Gives the disk space of a range back, where the file system can do that.
  void discard(std::uint64_t offset, std::uint64_t length) const;
  /// The first `size` bytes, which must have been written; outlives the ScratchFile.
  [[nodiscard]] std::unique_ptr<FileMapping> map(std::size_t size,
                                                 std::uint64_t resident_bytes) const;

 private:
  [[noreturn]] void fail(const std::string& what, int error) const;

  std::filesystem::path folder_;
  int descriptor_ = -1;
};

/// Appends to a part of a scratch file through a buffer. finish() must be called at the end.
class ScratchWriter {
 public:
  ScratchWriter(ScratchFile& file, std::uint64_t offset, std::size_t buffer_bytes);
  void append(std::span<const std::byte> bytes);
  /// Writes what is still in the buffer. Gives the offset behind it.
  std::uint64_t finish();

 private:
  ScratchFile& file_;
  std::uint64_t offset_;
  std::size_t buffer_bytes_;
  std::vector<std::byte> buffer_;
};

}  // namespace topoloc::mapping
