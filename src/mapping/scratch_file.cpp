// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/scratch_file.hpp"

#include <cerrno>
#include <fcntl.h>
#include <stdexcept>
#include <sys/mman.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace topoloc::mapping {
namespace {

/// -1 and errno if it cannot be created.
int open_nameless(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) {
    return descriptor;
  }
  // Not every file system has files without names: NFS, for one.
  std::string name = (folder / ".topoloc-cloud-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) {
    ::unlink(name.c_str());
  }
  return named;
}

}  // namespace

FileMapping::FileMapping(int descriptor, std::size_t size, std::uint64_t resident_bytes)
    : size_(size), resident_bytes_(resident_bytes) {
  void* const address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
  if (address == MAP_FAILED) {
    throw std::system_error(errno, std::generic_category());
  }
  data_ = static_cast<const std::byte*>(address);
}

FileMapping::~FileMapping() { ::munmap(const_cast<std::byte*>(data_), size_); }

void FileMapping::about_to_read(std::uint64_t bytes) const {
  if (read_.fetch_add(bytes) + bytes > resident_bytes_) {
    read_ = bytes;
    // Only a hint for memory: on a shared file mapping it loses no data.
    ::madvise(const_cast<std::byte*>(data_), size_, MADV_DONTNEED);
  }
}

ScratchFile::ScratchFile(std::filesystem::path folder)
    : folder_(std::move(folder)), descriptor_(open_nameless(folder_)) {
  if (descriptor_ < 0) {
    fail("cannot be created", errno);
  }
}

ScratchFile::~ScratchFile() { ::close(descriptor_); }

void ScratchFile::fail(const std::string& what, int error) const {
  throw std::runtime_error(folder_.string() + ": a scratch file for the point cloud " + what +
                           " in this folder (" + std::generic_category().message(error) +
                           "): make room or make it writable, choose another folder, or allow the "
                           "cloud more memory");
}

void ScratchFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      fail("cannot be written beyond " + std::to_string(offset / 1'000'000) + " MB",
           n < 0 ? errno : ENOSPC);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

void ScratchFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      fail("cannot be read at " + std::to_string(offset / 1'000'000) + " MB", n < 0 ? errno : EIO);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

void ScratchFile::discard(std::uint64_t offset, std::uint64_t length) const {
  // Where it fails, the space comes back with the rest of the file.
  static_cast<void>(::fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                                static_cast<off_t>(offset), static_cast<off_t>(length)));
}

std::unique_ptr<FileMapping> ScratchFile::map(std::size_t size,
                                              std::uint64_t resident_bytes) const {
  try {
    return std::make_unique<FileMapping>(descriptor_, size, resident_bytes);
  } catch (const std::system_error& error) {
    fail("cannot be mapped", error.code().value());
  }
}

ScratchWriter::ScratchWriter(ScratchFile& file, std::uint64_t offset, std::size_t buffer_bytes)
    : file_(file), offset_(offset), buffer_bytes_(buffer_bytes) {
  buffer_.reserve(buffer_bytes);
}

void ScratchWriter::append(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > buffer_bytes_) {
    finish();
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::uint64_t ScratchWriter::finish() {
  file_.write(offset_, buffer_);
  offset_ += buffer_.size();
  buffer_.clear();
  return offset_;
}

}  // namespace topoloc::mapping
