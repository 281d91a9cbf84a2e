// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/raw_socket.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <set>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace topoloc::can {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

ifreq request_for(const std::string& device) noexcept {
  ifreq request{};
  std::copy_n(device.begin(), std::min<std::size_t>(device.size(), IFNAMSIZ - 1),
              static_cast<char*>(request.ifr_name));
  return request;
}

/// "vcan0, can1", or "none".
std::string can_interfaces(int socket) {
  std::set<std::string> found;
  struct if_nameindex* const all = ::if_nameindex();
  for (const struct if_nameindex* entry = all; entry != nullptr && entry->if_index != 0; ++entry) {
    ifreq request = request_for(entry->if_name);
    if (::ioctl(socket, SIOCGIFHWADDR, &request) == 0 &&
        request.ifr_hwaddr.sa_family == ARPHRD_CAN) {
      found.insert(entry->if_name);
    }
  }
  if (all != nullptr) {
    ::if_freenameindex(all);
  }
  std::string names;
  for (const std::string& device_name : found) {
    names += (names.empty() ? "" : ", ") + device_name;
  }
  return names.empty() ? "none" : names;
}

}  // namespace

void fail_on(const std::string& device, const std::string& what) {
  throw std::runtime_error("CAN interface '" + device + "': " + what);
}

Descriptor::~Descriptor() {
  if (number_ >= 0) {
    ::close(number_);
  }
}

int Descriptor::release() { return std::exchange(number_, -1); }

int open_raw_socket(const std::string& device) {
  Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (socket.number() < 0) {
    if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT) {
      fail_on(device,
              "the kernel has no SocketCAN: load it with 'modprobe can-raw', or try on a "
              "virtual bus with tools/with-vcan");
    }
    fail_on(device, "cannot open a CAN socket: " + reason(errno));
  }
  const int on = 1;
  if (::setsockopt(socket.number(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)) != 0) {
    fail_on(device, "the kernel's SocketCAN knows no CAN FD: " + reason(errno));
  }
  return socket.release();
}

int interface_index(int socket, const std::string& device) noexcept {
  ifreq request = request_for(device);
  return ::ioctl(socket, SIOCGIFINDEX, &request) == 0 ? request.ifr_ifindex : 0;
}

bool bind_to_index(int socket, int index) noexcept {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  return ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
}

bool bind_to(int socket, const std::string& device) noexcept {
  const int index = interface_index(socket, device);
  return index != 0 && bind_to_index(socket, index);
}

void bind_or_throw(int socket, const std::string& device) {
  if (device.empty() || device.size() > kMaxInterfaceNameBytes) {
    fail_on(device, "a name of 1 to 15 letters is expected");
  }
  const int index = interface_index(socket, device);
  if (index == 0 || !bind_to_index(socket, index)) {
    const int error = errno;
    fail_on(device,
            (index != 0 ? error == ENODEV ? "is no CAN interface" : "cannot bind: " + reason(error)
                        : "there is no such interface") +
                " (CAN interfaces here: " + can_interfaces(socket) +
                "); plug it in, or set it up: ip link set " + device +
                " up type can bitrate 500000");
  }
}

bool is_up(int socket, const std::string& device) noexcept {
  ifreq request = request_for(device);
  return ::ioctl(socket, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
}

std::size_t to_kernel(const Frame& frame, canfd_frame& out) {
  if (frame.kind == FrameKind::kError ||
      frame.length > (frame.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN)) {
    return 0;
  }
  out = {};
  out.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) |
               (frame.kind == FrameKind::kRemote ? CAN_RTR_FLAG : 0U);
  out.len = frame.length;
  out.flags = frame.fd_flags;
  std::copy_n(frame.data.begin(), frame.length, static_cast<std::uint8_t*>(out.data));
  return frame.fd ? CANFD_MTU : CAN_MTU;
}

bool from_kernel(const canfd_frame& in, std::size_t size, Frame& out) {
  const bool fd = size == CANFD_MTU;
  if ((!fd && size != CAN_MTU) || in.len > (fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN)) {
    return false;
  }
  const bool error = (in.can_id & CAN_ERR_FLAG) != 0;
  const bool remote = (in.can_id & CAN_RTR_FLAG) != 0;
  out.extended = !error && (in.can_id & CAN_EFF_FLAG) != 0;
  out.id = in.can_id & (error || out.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.fd = fd;
  out.kind = error ? FrameKind::kError : remote ? FrameKind::kRemote : FrameKind::kData;
  out.fd_flags = fd ? in.flags & (CANFD_BRS | CANFD_ESI) : 0;
  out.length = in.len;
  out.data.fill(0);
  if (!remote) {
    std::copy_n(static_cast<const std::uint8_t*>(in.data), in.len, out.data.begin());
  }
  return true;
}

}  // namespace topoloc::can
