// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/lzf.hpp"

namespace topoloc::mapping {

// A control byte below 32 starts a run of control + 1 literal bytes. Any other is a back reference:
// its top three bits are the length - 2 (7: one more length byte follows), its low five bits and
// the next byte the distance - 1.
bool lzf_decompress(std::span<const std::byte> in, std::span<std::byte> out) {
  std::size_t from = 0;
  std::size_t to = 0;
  while (from < in.size()) {
    const auto control = std::to_integer<std::size_t>(in[from++]);
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > in.size() - from || length > out.size() - to) {
        return false;
      }
      for (std::size_t i = 0; i < length; ++i) {
        out[to++] = in[from++];
      }
      continue;
    }
    std::size_t length = control >> 5U;
    if (length == 7) {
      if (from == in.size()) {
        return false;
      }
      length += std::to_integer<std::size_t>(in[from++]);
    }
    length += 2;
    if (from == in.size()) {
      return false;
    }
    const std::size_t distance =
        ((control & 31U) << 8U) + std::to_integer<std::size_t>(in[from++]) + 1;
    if (distance > to || length > out.size() - to) {
      return false;
    }
    // Byte by byte: source and destination may overlap, which is how runs are coded.
    for (std::size_t i = 0; i < length; ++i, ++to) {
      out[to] = out[to - distance];
    }
  }
  return to == out.size();
}

}  // namespace topoloc::mapping
