// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "live/receive_buffer.hpp"

#include <charconv>
#include <string_view>
#include <sys/socket.h>
#include <unistd.h>

namespace topoloc::live {
namespace {

std::optional<int> wanted_bytes(std::string_view url) {
  constexpr std::string_view kKey = "recv_buf_size=";
  const std::size_t found = url.find(kKey);
  if (found == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view digits = url.substr(found + kKey.size());
  int bytes = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), bytes);
  return error == std::errc{} ? std::optional(bytes) : std::nullopt;
}

int granted_bytes(int wanted) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) {
    return 0;
  }
  int granted = 0;
  socklen_t size = sizeof(granted);
  setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
  getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  close(socket);
  return granted / 2;  // the kernel doubles it for its own bookkeeping
}

}  // namespace

ReceiveBuffer receive_buffer(const std::string& lcm_url) {
  ReceiveBuffer buffer;
  buffer.is_udp = lcm_url.empty() || lcm_url.starts_with("udpm://");
  buffer.wanted_bytes = wanted_bytes(lcm_url);
  if (buffer.wanted_bytes) {
    buffer.granted_bytes = granted_bytes(*buffer.wanted_bytes);
  }
  return buffer;
}

}  // namespace topoloc::live
