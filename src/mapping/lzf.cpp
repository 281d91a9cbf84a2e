// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/lzf.hpp"

#include <algorithm>

namespace topoloc::mapping {
namespace {

constexpr std::size_t kInputBuffer = 1 << 16;
constexpr std::size_t kWindow = 1 << 13;  // the farthest back reference

}  // namespace

LzfReader::LzfReader(std::istream& stream, std::uint64_t compressed_bytes)
    : stream_(stream), left_(compressed_bytes), window_(kWindow) {}

bool LzfReader::next_byte(std::byte& byte) {
  if (at_ == buffer_.size()) {
    buffer_.resize(std::min<std::uint64_t>(left_, kInputBuffer));
    left_ -= buffer_.size();
    at_ = 0;
    if (buffer_.empty() || !stream_.read(reinterpret_cast<char*>(buffer_.data()),
                                         static_cast<std::streamsize>(buffer_.size()))) {
      return false;
    }
  }
  byte = buffer_[at_++];
  return true;
}

// A control byte below 32 starts a run of control + 1 literal bytes. Any other is a back reference:
// its top three bits are the length - 2 (7: one more length byte follows), its low five bits and
// the next byte the distance - 1.
bool LzfReader::next_run() {
  std::byte byte{};
  if (!next_byte(byte)) {
    return false;
  }
  const auto control = std::to_integer<std::size_t>(byte);
  if (control < 32) {
    pending_ = control + 1;
    distance_ = 0;
    return true;
  }
  pending_ = (control >> 5U) + 2;
  if (pending_ == 9) {
    if (!next_byte(byte)) {
      return false;
    }
    pending_ += std::to_integer<std::size_t>(byte);
  }
  if (!next_byte(byte)) {
    return false;
  }
  distance_ = ((control & 31U) << 8U) + std::to_integer<std::size_t>(byte) + 1;
  return distance_ <= written_;
}

bool LzfReader::read(std::span<std::byte> out) {
  for (std::byte& byte : out) {
    if (pending_ == 0 && !next_run()) {
      return false;
    }
    // Byte by byte: source and destination may overlap, which is how runs are coded.
    if (distance_ > 0) {
      byte = window_[(written_ - distance_) % kWindow];
    } else if (!next_byte(byte)) {
      return false;
    }
    window_[written_++ % kWindow] = byte;
    --pending_;
  }
  return true;
}

bool LzfReader::skip(std::uint64_t bytes) {
  std::vector<std::byte> block(std::min<std::uint64_t>(bytes, kInputBuffer));
  while (bytes > 0) {
    const std::size_t here = std::min<std::uint64_t>(bytes, block.size());
    if (!read(std::span(block).first(here))) {
      return false;
    }
    bytes -= here;
  }
  return true;
}

}  // namespace topoloc::mapping
