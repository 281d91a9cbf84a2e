// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"
#include "topoloc/can/frame.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Counters and checksums that senders put into their messages.
namespace topoloc::can {

enum class Checksum : std::uint8_t {
  kXor8,         ///< of all bytes
  kSum8,         ///< of all bytes, modulo 256
  kCrc8J1850,    ///< SAE J1850: polynomial 0x1D, begins with 0xFF, inverted at the end
  kE2eProfile1,  ///< AUTOSAR E2E profile 1, both bytes of the data id: the same polynomial from 0
};
/// As in vehicle.yaml.
inline constexpr std::array<std::string_view, 4> kChecksumNames = {"xor8", "sum8", "crc8-j1850",
                                                                   "e2e-profile1"};

/// The checksum over the data id (low byte, high byte; where there is one) and all bytes of the
/// payload but the one `at` which it stands.
std::uint8_t checksum(Checksum algorithm, std::optional<std::uint16_t> data_id,
                      std::span<const std::uint8_t> payload, std::size_t at);

/// What is to be checked of one message. Signals are named without their message.
struct MessageCheckConfig {
  std::string message;
  std::string interface = {};  ///< empty: any
  std::string counter = {};    ///< empty: none
  /// Largest value; after it the counter is 0 again. Nothing: all the signal's bits set (14 for
  /// kE2eProfile1).
  std::optional<std::uint64_t> counter_max = std::nullopt;
  std::string checksum = {};  ///< a whole byte; empty: none
  Checksum algorithm = Checksum::kCrc8J1850;
  std::optional<std::uint16_t> data_id = std::nullopt;
  std::string place = {};  ///< where complaints shall point to, "vehicle.yaml:12: can.checks[0]"
};

enum class CheckVerdict : std::uint8_t {
  kOk,
  kTooShort,  ///< the payload ends before counter or checksum
  kWrongChecksum,
  kCounterOutOfRange,  ///< beyond its largest value
  kCounterFrozen,      ///< the same as before: repeated, or the sender stands still
};

/// Checks the frames of one message as they come. Allocates nothing once made.
class MessageCheck {
 public:
  /// Throws std::runtime_error where the message has no such signals or they cannot be checked.
  MessageCheck(const MessageCheckConfig& config, const Message& message);

  [[nodiscard]] const FrameId& id() const { return id_; }
  /// Empty: any.
  [[nodiscard]] std::string_view interface() const { return interface_; }
  [[nodiscard]] bool concerns(const Frame& frame) const;
  /// Of a data frame that it concerns.
  CheckVerdict check(const Frame& frame) noexcept;
  /// Messages missing between accepted ones, as far as the counter tells: it cannot tell one turn
  /// of it from the next.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Writes the right checksum, for tools that change a payload.
  void seal(Frame& frame) const;

 private:
  FrameId id_;
  std::string interface_;
  std::optional<SignalCoding> counter_;
  std::uint64_t counter_max_ = 0;
  std::optional<std::size_t> checksum_byte_;
  Checksum algorithm_;
  std::optional<std::uint16_t> data_id_;
  std::optional<std::uint64_t> last_counter_;
  std::uint64_t lost_ = 0;
};

/// Finds the messages in the databases. Throws as MessageCheck does, and where a message is in none
/// or several of them.
std::vector<MessageCheck> make_checks(const std::vector<MessageCheckConfig>& configs,
                                      const std::vector<Dbc>& dbcs);

}  // namespace topoloc::can
