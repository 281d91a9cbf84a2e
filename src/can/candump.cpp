// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/candump.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <stdexcept>

namespace topoloc::can {
namespace {

/// Also the longest line: a line that does not end within it is cut there and is malformed.
constexpr std::size_t kBufferBytes = 1 << 16;
constexpr std::size_t kShownCharacters = 60;

/// The start of a bad line for a message on one line of a terminal.
std::string printable(std::string_view line) {
  std::string text(line.substr(0, kShownCharacters));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace

CandumpReader::CandumpReader(const std::filesystem::path& file)
    : file_(file), stream_(file, std::ios::binary), buffer_(kBufferBytes) {
  if (!stream_ || std::filesystem::is_directory(file)) {
    throw std::runtime_error(file.string() + ": cannot open candump log");
  }
}

bool CandumpReader::next_line(std::string_view& line) {
  std::size_t searched = 0;
  for (;;) {
    const char* first = buffer_.data() + begin_;
    const auto* found =
        static_cast<const char*>(std::memchr(first + searched, '\n', end_ - begin_ - searched));
    if (found != nullptr) {
      line = {first, static_cast<std::size_t>(found - first)};
      begin_ += line.size() + 1;
      break;
    }
    searched = end_ - begin_;
    std::memmove(buffer_.data(), first, searched);
    begin_ = 0;
    end_ = searched;
    stream_.read(buffer_.data() + end_, static_cast<std::streamsize>(buffer_.size() - end_));
    const auto read = static_cast<std::size_t>(stream_.gcount());
    if (stream_.bad()) {
      throw std::runtime_error(file_.string() + ": read error");
    }
    end_ += read;
    if (read == 0) {  // the end of the file, or a line longer than the buffer
      if (end_ == 0) {
        return false;
      }
      line = {buffer_.data(), end_};
      begin_ = end_;
      break;
    }
  }
  ++line_number_;
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  return true;
}

bool CandumpReader::next(Frame& frame) {
  std::string_view line;
  while (next_line(line)) {
    if (line.find_first_not_of(" \t") == std::string_view::npos) {
      continue;
    }
    const CandumpError error = parse_candump_line(line, frame);
    if (error == CandumpError::kNone) {
      ++frame_count_;
      return true;
    }
    ++malformed_[static_cast<std::size_t>(error)];
    if (first_error_.empty()) {
      first_error_ = file_.string() + ":" + std::to_string(line_number_) + ": bad " +
                     std::string(name(error)) + " in '" + printable(line) +
                     "', expected '(seconds.micros) interface id#data'";
    }
  }
  if (frame_count_ == 0 && !first_error_.empty()) {
    throw std::runtime_error(first_error_ + "; no CAN frame in the whole file");
  }
  return false;
}

std::uint64_t CandumpReader::malformed_count() const {
  return std::accumulate(malformed_.begin(), malformed_.end(), std::uint64_t{0});
}

CandumpWriter::CandumpWriter(const std::filesystem::path& file)
    : file_(file), stream_(file, std::ios::binary) {
  if (!stream_) {
    throw std::runtime_error(file.string() + ": cannot create candump log");
  }
}

void CandumpWriter::write(const Frame& frame) { stream_ << format_candump_line(frame) << '\n'; }

void CandumpWriter::close() {
  stream_.close();
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": write error, the log is incomplete");
  }
}

}  // namespace topoloc::can
