// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/candump.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace topoloc::can {
namespace {

constexpr std::uint32_t kErrorFlag = 0x2000'0000U;   // as in a socket's can_id
constexpr std::int64_t kMaxSeconds = 9'000'000'000;  // times 1e9 fits int64
constexpr std::size_t kMaxClassicBytes = 8;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  if (c >= 'A' && c <= 'F') {
    return c - 'A' + 10;
  }
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/// Cuts the next blank-separated field off the front of a line.
std::string_view take_field(std::string_view& line) {
  const std::size_t first = line.find_first_not_of(" \t");
  line.remove_prefix(first == std::string_view::npos ? line.size() : first);
  const std::string_view field = line.substr(0, line.find_first_of(" \t"));
  line.remove_prefix(field.size());
  return field;
}

/// "(seconds.fraction)" in whole nanoseconds; no double in between.
std::optional<std::int64_t> parse_time(std::string_view field) {
  if (field.size() < 3 || field.front() != '(' || field.back() != ')') {
    return std::nullopt;
  }
  const char* at = field.data() + 1;
  const char* const end = field.data() + field.size() - 1;
  std::int64_t seconds = 0;
  const auto whole = std::from_chars(at, end, seconds);
  if (whole.ec != std::errc{} || *at == '-' || seconds > kMaxSeconds || *whole.ptr != '.') {
    return std::nullopt;
  }
  std::int64_t nanoseconds = 0;
  std::int64_t digit_ns = 100'000'000;
  for (at = whole.ptr + 1; at != end; ++at, digit_ns /= 10) {
    if (*at < '0' || *at > '9' || digit_ns == 0) {
      return std::nullopt;
    }
    nanoseconds += (*at - '0') * digit_ns;
  }
  return digit_ns == 100'000'000 ? std::nullopt
                                 : std::optional(seconds * 1'000'000'000 + nanoseconds);
}

/// Three hex digits: 11 bits. Eight: 29 bits, or an error frame's class.
bool parse_id(std::string_view digits, Frame& frame) {
  if (digits.size() != 3 && digits.size() != 8) {
    return false;
  }
  std::uint32_t id = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    return false;
  }
  frame.extended = digits.size() == 8;
  if (frame.extended && (id & kErrorFlag) != 0) {
    frame.extended = false;
    frame.kind = FrameKind::kError;
    id &= ~kErrorFlag;
    frame.id = id;
    return id <= kMaxExtendedId;
  }
  frame.id = id;
  return id <= (frame.extended ? kMaxExtendedId : kMaxStandardId);
}

/// What stands behind the first '#': "R8", "11223344", "1122334455667788_9" or "#<flags>1122".
bool parse_data(std::string_view text, Frame& frame) {
  if (text.starts_with('#')) {
    const int flags = text.size() > 1 ? hex_digit(text[1]) : -1;
    if (flags < 0) {
      return false;
    }
    frame.fd = true;
    frame.fd_flags = static_cast<std::uint8_t>(flags);
    text.remove_prefix(2);
  } else {
    // "_9" to "_F": the raw length code of classic frames of eight bytes. It changes no data.
    if (text.size() > 2 && text[text.size() - 2] == '_' && hex_digit(text.back()) > 8) {
      text.remove_suffix(2);
    }
    if (text.starts_with('R')) {
      frame.kind = FrameKind::kRemote;
      const int length = text.size() == 2 ? hex_digit(text[1]) : 0;
      frame.length = static_cast<std::uint8_t>(length);
      return text.size() <= 2 && length >= 0 && length <= static_cast<int>(kMaxClassicBytes);
    }
  }
  if (text.size() % 2 != 0 || text.size() / 2 > (frame.fd ? kMaxPayloadBytes : kMaxClassicBytes)) {
    return false;
  }
  frame.length = static_cast<std::uint8_t>(text.size() / 2);
  for (std::size_t i = 0; i < frame.length; ++i) {
    const int high = hex_digit(text[2 * i]);
    const int low = hex_digit(text[2 * i + 1]);
    if (high < 0 || low < 0) {
      return false;
    }
    frame.data[i] = static_cast<std::uint8_t>(high << 4 | low);
  }
  return true;
}

char* put_hex(char* out, std::uint32_t value, int digits) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    *out++ = kDigits[(value >> shift) & 0xFU];
  }
  return out;
}

std::string decimal(std::int64_t value, std::size_t digits) {
  const std::string text = std::to_string(value);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

}  // namespace

std::string_view name(CandumpError error) {
  constexpr std::array<std::string_view, kCandumpErrorCount> kNames = {
      "none", "time", "interface", "id", "data", "trailing text"};
  return kNames[static_cast<std::size_t>(error)];
}

CandumpError parse_candump_line(std::string_view line, Frame& frame) {
  frame = Frame{};
  const auto time_ns = parse_time(take_field(line));
  if (!time_ns) {
    return CandumpError::kTime;
  }
  frame.time_ns = *time_ns;
  const std::string_view interface = take_field(line);
  // A zero inside would end the name early, so that it equals no name that is looked for.
  if (interface.empty() || interface.size() > kMaxInterfaceNameBytes ||
      interface.find('\0') != std::string_view::npos) {
    return CandumpError::kInterface;
  }
  frame.set_interface(interface);
  const std::string_view body = take_field(line);
  const std::size_t hash = body.find('#');
  if (hash == std::string_view::npos || !parse_id(body.substr(0, hash), frame)) {
    return CandumpError::kId;
  }
  if (!parse_data(body.substr(hash + 1), frame)) {
    return CandumpError::kData;
  }
  const std::string_view direction = take_field(line);
  if (!direction.empty() && direction != "R" && direction != "T") {
    return CandumpError::kTrailing;
  }
  return take_field(line).empty() ? CandumpError::kNone : CandumpError::kTrailing;
}

std::string format_candump_line(const Frame& frame) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::int64_t fraction_ns = frame.time_ns % kSecond_ns;
  std::string line = "(" + decimal(frame.time_ns / kSecond_ns, 10) + ".";
  line += fraction_ns % 1000 == 0 ? decimal(fraction_ns / 1000, 6) : decimal(fraction_ns, 9);
  line += ") ";
  line += frame.interface();
  std::array<char, 16 + 2 * kMaxPayloadBytes> text{};
  char* out = text.data();
  *out++ = ' ';
  const bool error = frame.kind == FrameKind::kError;
  out = put_hex(out, error ? frame.id | kErrorFlag : frame.id, frame.extended || error ? 8 : 3);
  *out++ = '#';
  if (frame.kind == FrameKind::kRemote) {
    *out++ = 'R';
    if (frame.length > 0) {
      out = put_hex(out, frame.length, 1);
    }
  } else {
    if (frame.fd) {
      *out++ = '#';
      out = put_hex(out, frame.fd_flags, 1);
    }
    for (const std::uint8_t byte : frame.payload()) {
      out = put_hex(out, byte, 2);
    }
  }
  line.append(text.data(), static_cast<std::size_t>(out - text.data()));
  return line;
}

}  // namespace topoloc::can
