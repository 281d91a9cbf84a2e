// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <string_view>

namespace topoloc::apps {

/// Tells the service manager how the process is doing (systemd's notification protocol: datagrams
/// to the socket that NOTIFY_SOCKET names). Says nothing where there is none.
class ServiceNotifier {
 public:
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// "READY=1", "WATCHDOG=1", "STOPPING=1".
  void notify(std::string_view state) const;

 private:
  int socket_ = -1;
};

}  // namespace topoloc::apps
