// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <optional>
#include <string>

namespace topoloc::live {

/// The receive buffer that an LCM address asks for, and what this system grants.
struct ReceiveBuffer {
  bool is_udp = false;              ///< udpm:// or the default address
  std::optional<int> wanted_bytes;  ///< recv_buf_size of the address
  int granted_bytes = 0;            ///< read back from a socket
};

/// LCM keeps its socket to itself: one of our own is asked for the same.
ReceiveBuffer receive_buffer(const std::string& lcm_url);

}  // namespace topoloc::live
