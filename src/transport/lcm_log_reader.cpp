// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/lcm_log.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <optional>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace topoloc::transport {
namespace {

// An event in the file: sync word, number, time, two lengths (all big endian), channel, data.
constexpr std::uint32_t kSyncWord = 0xEDA1DA01U;
constexpr std::size_t kHeaderBytes = 4 + 8 + 8 + 4 + 4;
constexpr std::size_t kMaxDataBytes = 0x7FFF'FFFFU;

template <typename Unsigned>
Unsigned big_endian(std::span<const std::byte> bytes, std::size_t offset) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
    value = static_cast<Unsigned>(value << 8 | std::to_integer<Unsigned>(bytes[offset + i]));
  }
  return value;
}

struct Header {
  std::int64_t time_us;
  std::size_t channel_bytes;
  std::size_t data_bytes;
  [[nodiscard]] std::size_t total_bytes() const {
    return kHeaderBytes + channel_bytes + data_bytes;
  }
};

/// Nothing if there is no sync word or a length that LCM never writes. The event may reach beyond
/// the end of the file.
std::optional<Header> header_at(std::span<const std::byte> bytes, std::size_t offset) {
  if (bytes.size() - offset < kHeaderBytes ||
      big_endian<std::uint32_t>(bytes, offset) != kSyncWord) {
    return std::nullopt;
  }
  const Header header = {
      .time_us = static_cast<std::int64_t>(big_endian<std::uint64_t>(bytes, offset + 12)),
      .channel_bytes = big_endian<std::uint32_t>(bytes, offset + 20),
      .data_bytes = big_endian<std::uint32_t>(bytes, offset + 24)};
  if (header.channel_bytes < 1 || header.channel_bytes > kMaxChannelBytes ||
      header.data_bytes > kMaxDataBytes) {
    return std::nullopt;
  }
  return header;
}

bool whole_event_at(std::span<const std::byte> bytes, std::size_t offset) {
  const auto header = header_at(bytes, offset);
  return header && header->total_bytes() <= bytes.size() - offset;
}

/// A sound event is followed by another, or by the end: damaged lengths are not. Only then is a
/// sync word found by searching trusted, for it may also occur in a payload.
bool in_step_at(std::span<const std::byte> bytes, std::size_t offset) {
  if (!whole_event_at(bytes, offset)) {
    return false;
  }
  const std::size_t next = offset + header_at(bytes, offset)->total_bytes();
  return bytes.size() - next < kHeaderBytes || header_at(bytes, next).has_value();
}

std::size_t find_event(std::span<const std::byte> bytes, std::size_t from) {
  while (from < bytes.size()) {
    const auto first = std::find(bytes.begin() + static_cast<std::ptrdiff_t>(from), bytes.end(),
                                 std::byte{kSyncWord >> 24});
    from = static_cast<std::size_t>(first - bytes.begin());
    if (from < bytes.size() && in_step_at(bytes, from)) {
      return from;
    }
    ++from;
  }
  return bytes.size();
}

std::span<const std::byte> map_file(const std::filesystem::path& file) {
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error(file.string() + ": " + what + ": " +
                             std::generic_category().message(errno));
  };
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    fail("cannot open LCM log");
  }
  struct stat status {};
  const bool known = ::fstat(descriptor, &status) == 0;
  if (!known || !S_ISREG(status.st_mode) || status.st_size == 0) {
    ::close(descriptor);
    if (!known) {
      fail("cannot read LCM log");
    }
    throw std::runtime_error(file.string() + ": an LCM log must be a file with something in it");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
  ::close(descriptor);  // the mapping stays
  if (address == MAP_FAILED) {
    fail("cannot map LCM log");
  }
  return {static_cast<const std::byte*>(address), size};
}

void unmap(std::span<const std::byte> bytes) {
  if (!bytes.empty()) {
    ::munmap(const_cast<std::byte*>(bytes.data()), bytes.size());
  }
}

}  // namespace

LcmLogReader::LcmLogReader(const std::filesystem::path& file) : bytes_(map_file(file)) {
  try {
    index(file);
  } catch (...) {
    unmap(bytes_);
    throw;
  }
}

LcmLogReader::~LcmLogReader() { unmap(bytes_); }

LcmLogReader::LcmLogReader(LcmLogReader&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})),
      offsets_(std::move(other.offsets_)),
      by_channel_(std::move(other.by_channel_)),
      damage_(std::move(other.damage_)) {}

LcmLogReader& LcmLogReader::operator=(LcmLogReader&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(offsets_, other.offsets_);
  std::swap(by_channel_, other.by_channel_);
  std::swap(damage_, other.damage_);
  return *this;
}

void LcmLogReader::index(const std::filesystem::path& file) {
  for (std::size_t offset = 0; offset < bytes_.size();) {
    if (whole_event_at(bytes_, offset)) {
      const LogEvent found = event_at(offset);
      by_channel_[std::string(found.channel)].push_back(offsets_.size());
      offsets_.push_back(offset);
      offset += header_at(bytes_, offset)->total_bytes();
      continue;
    }
    const std::size_t next = find_event(bytes_, offset + 1);
    const bool truncated = next == bytes_.size();
    if (damage_.first.empty()) {
      damage_.first = file.string() + ": byte " + std::to_string(offset) + ": " +
                      (truncated ? "no whole event from here to the end of the file"
                                 : "no event here, reading on at byte " + std::to_string(next));
    }
    damage_.truncated = truncated;
    damage_.corrupt_regions += truncated ? 0 : 1;
    damage_.skipped_bytes += next - offset;
    offset = next;
  }
  if (offsets_.empty()) {
    throw std::runtime_error(damage_.first + "; not an LCM log, or cut off in its first event");
  }
}

LogEvent LcmLogReader::event_at(std::uint64_t offset) const {
  const auto header = header_at(bytes_, offset);
  const auto channel = bytes_.subspan(offset + kHeaderBytes, header->channel_bytes);
  return {
      .time_us = header->time_us,
      .channel = {reinterpret_cast<const char*>(channel.data()), channel.size()},
      .data = bytes_.subspan(offset + kHeaderBytes + header->channel_bytes, header->data_bytes)};
}

LogEvent LcmLogReader::event(std::size_t index) const { return event_at(offsets_.at(index)); }

std::span<const std::size_t> LcmLogReader::events_on(std::string_view channel) const {
  const auto found = by_channel_.find(channel);
  return found == by_channel_.end() ? std::span<const std::size_t>{} : found->second;
}

std::vector<std::string> LcmLogReader::channels() const {
  std::vector<std::string> names;
  for (const auto& [channel, events] : by_channel_) {
    names.push_back(channel);
  }
  return names;
}

}  // namespace topoloc::transport
