// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <span>
#include <vector>

namespace topoloc::mapping {

/// Decompresses an LZF block (the compression of PCD's binary_compressed) piece by piece, so that
/// its size does not matter: back references reach 8 KiB at most.
class LzfReader {
 public:
  /// Takes `compressed_bytes` from where the stream stands; it must outlive the reader.
  LzfReader(std::istream& stream, std::uint64_t compressed_bytes);

  /// The next out.size() bytes; false if the block is corrupt or ends before.
  [[nodiscard]] bool read(std::span<std::byte> out);
  /// Leaves bytes out; false as for read().
  [[nodiscard]] bool skip(std::uint64_t bytes);
  /// True if everything was read, of the output as of the block.
  [[nodiscard]] bool at_end() const { return pending_ == 0 && left_ == 0 && at_ == buffer_.size(); }

 private:
  bool next_run();
  bool next_byte(std::byte& byte);

  std::istream& stream_;
  std::uint64_t left_;  // compressed bytes that are not in the buffer yet
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;
  std::vector<std::byte> window_;  // the output's last bytes, as a ring
  std::uint64_t written_ = 0;
  std::size_t pending_ = 0;   // bytes to come of the current run
  std::size_t distance_ = 0;  // of a back reference; 0: literal run
};

}  // namespace topoloc::mapping
