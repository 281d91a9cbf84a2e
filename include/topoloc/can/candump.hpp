// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

/// Log files of can-utils: candump -L writes them, canplayer plays them.
///
///     (1533226488.434432) can0 260#08FFFB0000001884      classic, 11-bit id
///     (1533226488.434450) can0 18FEF100#DEADBEEF         29-bit id: eight hex digits
///     (1533226488.434461) can0 123##1112233              CAN FD, flags 1
///     (1533226488.434470) can0 123#R8                    remote frame
///     (1533226488.434480) can0 20000004#0004000000000000 error frame
///     (1533226488.434490123) can0 123#11 T               nanoseconds; direction R or T
namespace topoloc::can {

enum class CandumpError : std::uint8_t {
  kNone,
  kTime,
  kInterface,
  kId,
  kData,
  kTrailing,
};
inline constexpr std::size_t kCandumpErrorCount = 6;
std::string_view name(CandumpError error);

/// Parses one line without its line end; `frame` is unspecified unless kNone comes back.
CandumpError parse_candump_line(std::string_view line, Frame& frame);

/// One line without line end. Six decimals of time, nine where the nanoseconds need them.
std::string format_candump_line(const Frame& frame);

/// Reads a log of any size in one pass. Blank lines are skipped, malformed lines counted.
class CandumpReader {
 public:
  /// Throws std::runtime_error if the file cannot be opened.
  explicit CandumpReader(const std::filesystem::path& file);

  /// False at the end of the file. Throws std::runtime_error on a read error, and at the end of a
  /// file that held lines but not one frame: then it is no candump log.
  bool next(Frame& frame);

  [[nodiscard]] std::uint64_t frame_count() const { return frame_count_; }
  [[nodiscard]] std::uint64_t malformed_count() const;
  [[nodiscard]] std::uint64_t malformed_count(CandumpError reason) const {
    return malformed_[static_cast<std::size_t>(reason)];
  }
  /// "FILE:LINE: ..." of the first malformed line; empty if there was none.
  [[nodiscard]] const std::string& first_error() const { return first_error_; }

 private:
  bool next_line(std::string_view& line);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;  ///< unread part of the buffer
  std::size_t end_ = 0;
  std::uint64_t line_number_ = 0;
  std::uint64_t frame_count_ = 0;
  std::array<std::uint64_t, kCandumpErrorCount> malformed_{};
  std::string first_error_;
};

/// Writes a log that CandumpReader and canplayer read.
class CandumpWriter {
 public:
  /// Throws std::runtime_error if the file cannot be created.
  explicit CandumpWriter(const std::filesystem::path& file);
  void write(const Frame& frame);
  /// Flushes and throws std::runtime_error if anything was not written (disk full). Without it the
  /// destructor closes silently.
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace topoloc::can
