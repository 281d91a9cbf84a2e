// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/can_sender.hpp"

#include "can/raw_socket.hpp"

#include <array>
#include <cerrno>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <unistd.h>

namespace topoloc::can {

std::string_view name(SendVerdict verdict) {
  constexpr std::array<std::string_view, kSendVerdictCount> kNames = {
      "sent", "queue full", "interface down", "interface gone", "not supported", "failed"};
  return kNames[static_cast<std::size_t>(verdict)];
}

CanSender::CanSender(const std::string& device) : device_(device) {
  Descriptor opened(open_raw_socket(device));
  bind_or_throw(opened.number(), device);
  // Nothing is read from it: no filter, no frames.
  ::setsockopt(opened.number(), SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0);
  socket_ = opened.release();
}

CanSender::~CanSender() { ::close(socket_); }

SendVerdict CanSender::send(const Frame& frame) noexcept {
  canfd_frame out;
  const std::size_t size = to_kernel(frame, out);
  if (size == 0) {
    return SendVerdict::kNotSupported;
  }
  if (!bound_) {
    bound_ = bind_to(socket_, device_);
    if (!bound_) {
      return SendVerdict::kGone;
    }
  }
  // The second attempt is for what the first was told of something that is over.
  for (int attempt = 0;; ++attempt) {
    if (::send(socket_, &out, size, MSG_DONTWAIT) == static_cast<ssize_t>(size)) {
      return SendVerdict::kSent;
    }
    const int error = errno;
    switch (error) {
      case ENOBUFS:
      case EAGAIN:
        return SendVerdict::kQueueFull;
      case EINVAL:
        return SendVerdict::kNotSupported;
      case ENETDOWN:
        if (attempt == 0 && is_up(socket_, device_)) {
          continue;
        }
        return SendVerdict::kDown;
      case ENODEV:
      case ENXIO:
        bound_ = bind_to(socket_, device_);
        if (attempt == 0 && bound_) {
          continue;
        }
        return SendVerdict::kGone;
      default:
        return SendVerdict::kFailed;
    }
  }
}

}  // namespace topoloc::can
