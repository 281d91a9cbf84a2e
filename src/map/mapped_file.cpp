// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/mapped_file.hpp"

#include "topoloc/map/types.hpp"

#include <cerrno>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace topoloc::map {
namespace {

std::int64_t modified_ns(const struct stat& status) {
  return std::int64_t{1'000'000'000} * status.st_mtim.tv_sec + status.st_mtim.tv_nsec;
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& what) {
    if (fd_ >= 0) {
      close(fd_);
    }
    throw MapError(path.string() + ": " + what);
  };
  const auto reason = [] { return ": " + std::generic_category().message(errno); };
  fd_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) {
    fail("cannot open" + reason());
  }
  struct stat status {};
  if (fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) {
    fail("not a regular file");
  }
  if (status.st_size == 0) {
    fail("empty file, not a topoloc map");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const address = mmap(nullptr, size, PROT_READ, MAP_SHARED, fd_, 0);
  if (address == MAP_FAILED) {
    fail("cannot map into memory" + reason());
  }
  bytes_ = {static_cast<const std::byte*>(address), size};
  modified_ns_ = modified_ns(status);
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) {
    munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
    close(fd_);
  }
}

MappedFile::MappedFile(MappedFile&& other) noexcept { *this = std::move(other); }

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(bytes_, other.bytes_);
  std::swap(modified_ns_, other.modified_ns_);
  return *this;
}

bool MappedFile::unchanged() const {
  struct stat status {};
  return fstat(fd_, &status) == 0 && static_cast<std::size_t>(status.st_size) == bytes_.size() &&
         modified_ns(status) == modified_ns_;
}

}  // namespace topoloc::map
