// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/can_socket.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <system_error>

namespace topoloc::can {
namespace {

/// An error is told once, before the frames that are there: so look again, but not for ever.
constexpr int kMaxReads = 3;

std::int64_t to_ns(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

CanSocket::CanSocket(const CanInput& input, const CanReceiverOptions& options)
    : device_(input.device),
      socket_(open_raw_socket(input.device)),
      rebind_interval_ns_(options.rebind_interval_ns),
      payloads_(options.frames_per_call),
      vectors_(options.frames_per_call),
      controls_(options.frames_per_call),
      headers_(options.frames_per_call) {
  Frame named;
  named.set_interface(input.interface.empty() ? input.device : input.interface);
  frames_interface_ = named.interface_name;
  for (std::size_t i = 0; i < headers_.size(); ++i) {
    vectors_[i] = {.iov_base = &payloads_[i], .iov_len = sizeof(canfd_frame)};
    headers_[i].msg_hdr.msg_iov = &vectors_[i];
    headers_[i].msg_hdr.msg_iovlen = 1;
    headers_[i].msg_hdr.msg_control = controls_[i].bytes.data();
  }
  // All is set before the first frame can come in.
  make_filters(input);
  if (!set_filters()) {
    fail_on(device_, "cannot set the filter: " + std::generic_category().message(errno));
  }
  set_buffer(options.buffer_bytes);
  request_stamps();
  bind_or_throw(socket_.number(), device_);
  state_ = is_up(socket_.number(), device_) ? CanState::kUp : CanState::kDown;
}

void CanSocket::make_filters(const CanInput& input) {
  if (input.ids.size() > CAN_RAW_FILTER_MAX) {
    fail_on(device_, "the kernel filters by at most " + std::to_string(CAN_RAW_FILTER_MAX) +
                         " ids, " + std::to_string(input.ids.size()) + " are configured");
  }
  for (const FrameId& id : input.ids) {
    filters_.push_back({.can_id = id.id | (id.extended ? CAN_EFF_FLAG : 0U),
                        .can_mask = CAN_EFF_FLAG | (id.extended ? CAN_EFF_MASK : CAN_SFF_MASK)});
  }
  if (filters_.empty()) {
    filters_.push_back({.can_id = 0, .can_mask = 0});  // lets all through
  }
}

bool CanSocket::set_filters() noexcept {
  const auto bytes = static_cast<socklen_t>(filters_.size() * sizeof(can_filter));
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  return ::setsockopt(socket_.number(), SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(), bytes) == 0 &&
         ::setsockopt(socket_.number(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors,
                      sizeof(all_errors)) == 0;
}

void CanSocket::set_buffer(int bytes) {
  // With CAP_NET_ADMIN beyond net.core.rmem_max; else the kernel grants what that allows.
  if (::setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof(bytes)) != 0) {
    ::setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
  }
  int granted = 0;
  socklen_t size = sizeof(granted);
  if (::getsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0) {
    buffer_bytes_ = granted / 2;  // the kernel doubles it, for its own bookkeeping
  }
}

void CanSocket::request_stamps() {
  const int on = 1;
  ::setsockopt(socket_.number(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on));
  const int both = SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE |
                   SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  if (::setsockopt(socket_.number(), SOL_SOCKET, SO_TIMESTAMPING, &both, sizeof(both)) != 0 &&
      ::setsockopt(socket_.number(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on)) != 0) {
    fail_on(device_, "the kernel gives no time stamps: " + std::generic_category().message(errno));
  }
}

CanSocket::Read CanSocket::read(std::span<Frame> out, std::int64_t now_ns) noexcept {
  Read result;
  if (state_ != CanState::kUp) {
    look_after_interface(now_ns);
  }
  for (int reads = 0; reads < kMaxReads && result.frames < out.size(); ++reads) {
    const std::size_t wanted = std::min(out.size() - result.frames, headers_.size());
    for (std::size_t i = 0; i < wanted; ++i) {
      headers_[i].msg_hdr.msg_controllen = sizeof(Control);
    }
    const int count = ::recvmmsg(socket_.number(), headers_.data(), static_cast<unsigned>(wanted),
                                 MSG_DONTWAIT, nullptr);
    if (count < 0) {
      const int error = errno;
      if (error == EAGAIN || error == EWOULDBLOCK) {
        return result;
      }
      note_error(error, now_ns);
      continue;
    }
    const auto received = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < received; ++i) {
      result.frames += take(i, now_ns, out[result.frames]) ? 1 : 0;
    }
    if (received < wanted) {
      return result;
    }
  }
  result.cut_short = true;
  ++counters_.capped_reads;
  return result;
}

void CanSocket::note_error(int error, std::int64_t now_ns) noexcept {
  switch (error) {
    case EINTR:
      return;
    case ENETDOWN:
      // Also told of an interface that was down when it was bound.
      counters_.went_down += state_ == CanState::kUp ? 1 : 0;
      state_ = state_ == CanState::kUp ? CanState::kDown : state_;
      break;
    case ENODEV:
      counters_.disappeared += state_ == CanState::kGone ? 0 : 1;
      state_ = CanState::kGone;
      break;
    default:
      ++counters_.read_errors;
      return;
  }
  next_look_ns_ = now_ns + rebind_interval_ns_;
}

void CanSocket::look_after_interface(std::int64_t now_ns) noexcept {
  // A clock that was set back must not put the next look off.
  const bool due = now_ns >= next_look_ns_ || next_look_ns_ - now_ns > rebind_interval_ns_;
  if (!due) {
    return;
  }
  next_look_ns_ = now_ns + rebind_interval_ns_;
  if (state_ == CanState::kGone) {
    // The kernel forgot the filters together with the interface. It takes a lock for setting them
    // that all changes of network interfaces share, so not before there is one to set them for.
    const int index = interface_index(socket_.number(), device_);
    if (index == 0 || !set_filters() || !bind_to_index(socket_.number(), index)) {
      ++counters_.failed_rebinds;
      return;
    }
    state_ = CanState::kDown;
  }
  if (is_up(socket_.number(), device_)) {
    state_ = CanState::kUp;
    ++counters_.came_back;
  }
}

bool CanSocket::take(std::size_t index, std::int64_t now_ns, Frame& frame) noexcept {
  const canfd_frame& raw = payloads_[index];
  const Stamps stamps = read_control(headers_[index].msg_hdr);
  if (!from_kernel(raw, headers_[index].msg_len, frame)) {
    ++counters_.malformed;
    return false;
  }
  if (frame.kind == FrameKind::kError) {
    count_error_frame(raw);
    return false;
  }
  std::int64_t time_ns = stamps.software_ns;
  if (time_ns == 0) {
    ++counters_.missing_stamps;
    time_ns = now_ns;
  }
  if (stamps.hardware_ns != 0) {
    ++counters_.hardware_stamps;
    time_ns = hardware_clock_.unix_ns(stamps.hardware_ns, time_ns);
  }
  frame.time_ns = time_ns;
  frame.interface_name = frames_interface_;
  return true;
}

CanSocket::Stamps CanSocket::read_control(msghdr& header) noexcept {
  Stamps stamps;
  for (cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr;
       control = CMSG_NXTHDR(&header, control)) {
    if (control->cmsg_level != SOL_SOCKET) {
      continue;
    }
    if (control->cmsg_type == SCM_TIMESTAMPING) {
      scm_timestamping times{};
      std::memcpy(&times, CMSG_DATA(control), sizeof(times));
      stamps.software_ns = to_ns(times.ts[0]);
      stamps.hardware_ns = to_ns(times.ts[2]);
    } else if (control->cmsg_type == SCM_TIMESTAMPNS) {
      timespec time{};
      std::memcpy(&time, CMSG_DATA(control), sizeof(time));
      stamps.software_ns = to_ns(time);
    } else if (control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t drops = 0;
      std::memcpy(&drops, CMSG_DATA(control), sizeof(drops));
      counters_.dropped += drops - kernel_drops_;  // the kernel's counter wraps
      kernel_drops_ = drops;
    }
  }
  return stamps;
}

void CanSocket::count_error_frame(const canfd_frame& frame) noexcept {
  const canid_t classes = frame.can_id & CAN_ERR_MASK;
  const std::uint8_t controller = (classes & CAN_ERR_CRTL) != 0 ? frame.data[1] : 0;
  const bool warning = (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING |
                                      CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
  const bool overflow = (controller & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0;
  const bool off = (classes & CAN_ERR_BUSOFF) != 0;
  const bool restarted = (classes & CAN_ERR_RESTARTED) != 0;
  ++counters_.error_frames;
  counters_.controller_warnings += warning ? 1 : 0;
  counters_.controller_overflows += overflow ? 1 : 0;
  counters_.bus_off += off ? 1 : 0;
  counters_.restarted += restarted ? 1 : 0;
  counters_.other_errors += warning || overflow || off || restarted ? 0 : 1;
}

}  // namespace topoloc::can
