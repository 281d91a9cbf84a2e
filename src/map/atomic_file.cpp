// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map/atomic_file.hpp"

#include "topoloc/map/types.hpp"

#include <atomic>
#include <cerrno>
#include <fcntl.h>
#include <string>
#include <system_error>
#include <unistd.h>

namespace topoloc::map {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what, int error) {
  throw MapError(path.string() + ": " + what + ": " + std::generic_category().message(error));
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// Creates a new file beside `path` under a name that nothing else uses.
int create_beside(const std::filesystem::path& path, std::filesystem::path& created) {
  static std::atomic<unsigned> counter{0};
  if (path.filename().empty()) {
    throw MapError(path.string() + ": not a file name");
  }
  for (;;) {
    created = folder_of(path) / ("." + path.filename().string() + "." + std::to_string(getpid()) +
                                 "." + std::to_string(counter++) + ".tmp");
    const int fd = open(created.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) {
      return fd;
    }
    if (errno != EEXIST) {
      fail(path, "cannot create a temporary file beside it", errno);
    }
  }
}

/// Returns 0 or the error number.
int write_all(int fd, std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      return n < 0 ? errno : ENOSPC;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return 0;
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(path), fd_(create_beside(path, temporary_)) {}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) {
    close(fd_);
  }
  if (!temporary_.empty()) {
    unlink(temporary_.c_str());
  }
}

void AtomicFile::append(std::span<const std::byte> bytes) {
  write(size_, bytes);
  size_ += bytes.size();
}

void AtomicFile::overwrite(std::uint64_t offset, std::span<const std::byte> bytes) {
  write(offset, bytes);
}

void AtomicFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  const int error = write_all(fd_, offset, bytes);
  if (error != 0) {
    failed_ = true;
    fail(path_, "cannot write", error);
  }
}

void AtomicFile::commit() {
  if (failed_ || fd_ < 0) {
    throw MapError(path_.string() + ": not written: an earlier write failed");
  }
  if (fsync(fd_) != 0) {
    fail(path_, "cannot sync to disk", errno);
  }
  // A failed close can still report a lost write (NFS).
  const int fd = fd_;
  fd_ = -1;
  if (close(fd) != 0) {
    fail(path_, "cannot close", errno);
  }
  if (rename(temporary_.c_str(), path_.c_str()) != 0) {
    fail(path_, "cannot rename the finished file into place", errno);
  }
  temporary_.clear();
  // The rename itself must survive a power cut too.
  const int folder = open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) {
    fail(path_, "cannot open its folder to sync it", errno);
  }
  const int error = fsync(folder) != 0 ? errno : 0;
  close(folder);
  if (error != 0) {
    fail(path_, "cannot sync its folder to disk", error);
  }
}

SpoolFile::SpoolFile(const std::filesystem::path& beside) : beside_(beside) {
  std::filesystem::path created;
  fd_ = create_beside(beside, created);
  unlink(created.c_str());
}

SpoolFile::~SpoolFile() { close(fd_); }

void SpoolFile::append(std::span<const std::byte> bytes) {
  const int error = write_all(fd_, size_, bytes);
  if (error != 0) {
    fail(beside_, "cannot write its temporary file", error);
  }
  size_ += bytes.size();
}

void SpoolFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n = pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) {
      continue;
    }
    if (n <= 0) {
      fail(beside_, "cannot read its temporary file", n < 0 ? errno : EIO);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

}  // namespace topoloc::map
