// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/lcm_connection.hpp"

#include <stdexcept>

namespace topoloc::transport {

void require_open(lcm::LCM& lcm, const std::string& url) {
  if (!lcm.good()) {
    throw std::runtime_error("LCM cannot be opened at '" + url +
                             "': is the address right, and is there multicast (on one machine: ip "
                             "link set lo multicast on; ip route add 224.0.0.0/4 dev lo)?");
  }
}

}  // namespace topoloc::transport
