// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "service_notifier.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace topoloc::apps {

ServiceNotifier::ServiceNotifier() {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  const std::string_view name = path != nullptr ? path : "";
  if (name.size() < 2 || name.size() >= sizeof(address.sun_path)) {
    return;
  }
  address.sun_family = AF_UNIX;
  std::copy(name.begin(), name.end(), address.sun_path);
  if (name.front() == '@') {
    address.sun_path[0] = '\0';  // an abstract socket: no file
  }
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ >= 0 && connect(socket_, reinterpret_cast<sockaddr*>(&address), length) != 0) {
    close(socket_);
    socket_ = -1;
  }
}

ServiceNotifier::~ServiceNotifier() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

void ServiceNotifier::notify(std::string_view state) const {
  if (socket_ >= 0) {
    send(socket_, state.data(), state.size(), MSG_NOSIGNAL);
  }
}

}  // namespace topoloc::apps
