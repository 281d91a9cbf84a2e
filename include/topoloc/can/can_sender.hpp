// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace topoloc::can {

enum class SendVerdict : std::uint8_t {
  kSent,          ///< in the interface's queue
  kQueueFull,     ///< try again later
  kDown,          ///< the interface is down
  kGone,          ///< the interface is not there any more
  kNotSupported,  ///< CAN FD on a classic interface, or an error frame
  kFailed,        ///< any other error
};
inline constexpr std::size_t kSendVerdictCount = 6;
std::string_view name(SendVerdict verdict);

/// Sends frames to one CAN interface. For tools: the localiser itself never sends.
class CanSender {
 public:
  /// Throws std::runtime_error that names the interface and says what to do.
  explicit CanSender(const std::string& device);
  ~CanSender();
  CanSender(const CanSender&) = delete;
  CanSender& operator=(const CanSender&) = delete;

  /// Never blocks. Time and interface of the frame are ignored. Of an interface that is gone each
  /// call looks whether it is there again.
  SendVerdict send(const Frame& frame) noexcept;

  [[nodiscard]] const std::string& device() const { return device_; }

 private:
  std::string device_;
  int socket_ = -1;
  bool bound_ = true;
};

}  // namespace topoloc::can
