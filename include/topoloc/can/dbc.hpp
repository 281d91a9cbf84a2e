// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/signal_coding.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace topoloc::can {

/// Range of raw multiplexor values, both ends included.
struct MultiplexRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

inline constexpr int kNoMultiplexor = -1;

struct Signal {
  std::string name;
  SignalCoding coding;
  double minimum = 0.0;  ///< in the DBC's unit; no limits are given where minimum >= maximum
  double maximum = 0.0;
  std::string unit;
  bool is_multiplexor = false;       ///< "M", "m0M": selects which other signals are present
  int multiplexor = kNoMultiplexor;  ///< index in Message::signals of what selects this signal
  std::vector<MultiplexRange> selected_by;  ///< raw values of the multiplexor; empty: always there
  std::vector<std::pair<std::int64_t, std::string>> value_names;  ///< from VAL_

  [[nodiscard]] bool has_limits() const { return minimum < maximum; }
};

struct Message {
  std::uint32_t id = 0;  ///< without the flag for extended ids
  bool extended = false;
  std::string name;
  std::uint16_t length_bytes = 0;
  std::vector<Signal> signals;  ///< in the file's order

  [[nodiscard]] const Signal* find(std::string_view signal_name) const;
};

/// Whether the payload carries the signal: every multiplexor on the way to it has one of the
/// values that select it. True for signals without multiplexor.
bool is_present(const Message& message, const Signal& signal,
                std::span<const std::uint8_t> payload);

/// What "MESSAGE.SIGNAL" stands for; points into its Dbc.
struct SignalRef {
  const Message* message = nullptr;
  const Signal* signal = nullptr;
};

/// A CAN database (Vector DBC), as found in the wild: Windows line ends, Latin-1 units, comments
/// over several lines, overlapping signals. Keeps messages, signals, multiplexing (simple and
/// extended), float types and value names; skips attributes, comments and nodes.
class Dbc {
 public:
  /// Throws std::runtime_error "FILE:LINE: ..." on anything that is not a DBC file.
  static Dbc load(const std::filesystem::path& file);
  /// The same from memory; `name` stands for the file in error messages.
  static Dbc parse(std::string_view text, const std::string& name);

  [[nodiscard]] const std::vector<Message>& messages() const { return messages_; }
  /// Null if there is none.
  [[nodiscard]] const Message* find(std::uint32_t id, bool extended) const;
  /// Throws std::runtime_error that names the file and suggests close names, also for signals
  /// that cannot be decoded (longer than 64 bits).
  [[nodiscard]] SignalRef signal(std::string_view message_dot_signal) const;

 private:
  Dbc(std::string name, std::vector<Message> messages);

  std::string name_;
  std::vector<Message> messages_;  ///< in the file's order
};

}  // namespace topoloc::can
