// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/video_calls.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <linux/videodev2.h>
#include <map>
#include <poll.h>
#include <set>
#include <string>
#include <vector>

namespace topoloc::camera {

/// A V4L2 driver with one camera, by a script. Time stands still but for waiting and sleeping. It
/// holds the caller to the rules: no call on a closed descriptor, no streaming before buffers are
/// queued, nothing left open or mapped.
class FakeCamera final : public VideoCalls {
 public:
  struct Frame {
    std::vector<std::uint8_t> data;
    std::int64_t stamp_ns = 0;
    std::uint32_t sequence = 0;
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  };
  struct Size {
    std::uint32_t width;
    std::uint32_t height;
  };

  // The script.
  std::string path = "/dev/video0";
  int open_error = 0;  ///< errno of open(), while not 0
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> codes = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY};
  std::vector<Size> sizes = {{8, 4}, {4, 2}};
  std::uint32_t padding = 0;  ///< bytes after each row
  std::uint32_t most_buffers = 4;
  std::uint32_t fps = 10;
  std::map<std::uint32_t, std::int32_t> controls;
  std::deque<Frame> frames;  ///< those still to come; none: poll waits in vain
  bool plugged = true;
  int dequeue_error = 0;

  // What came of it.
  std::int64_t now = 1'000'000'000'000;
  std::int64_t ahead = 1'700'000'000'000'000'000;
  int opened = 0;
  int open_now = 0;
  int mapped = 0;
  bool streaming = false;
  v4l2_pix_format format = pixel_format(V4L2_PIX_FMT_YUYV, 8, 4);
  std::set<std::uint32_t> queued;

  int open(const std::string& name) override {
    if (!plugged || name != path) {
      return -ENOENT;
    }
    if (open_error != 0) {
      return -open_error;
    }
    ++opened;
    ++open_now;
    descriptor_ = 100 + opened;
    return descriptor_;
  }

  void close(int descriptor) override {
    if (descriptor == descriptor_) {
      --open_now;
      descriptor_ = -1;
      streaming = false;
      queued.clear();
    }
  }

  int control(int descriptor, unsigned long request, void* argument) override {
    if (descriptor != descriptor_) {
      return -EBADF;
    }
    if (!plugged) {
      return -ENODEV;
    }
    switch (request) {
      case VIDIOC_QUERYCAP:
        return query_capability(*static_cast<v4l2_capability*>(argument));
      case VIDIOC_ENUM_FMT:
        return enumerate(*static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_ENUM_FRAMESIZES:
        return enumerate(*static_cast<v4l2_frmsizeenum*>(argument));
      case VIDIOC_G_FMT:
        static_cast<v4l2_format*>(argument)->fmt.pix = format;
        return 0;
      case VIDIOC_S_FMT:
        return set_format(static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_G_PARM:
        return get_rate(*static_cast<v4l2_streamparm*>(argument));
      case VIDIOC_S_PARM:  // it has one rate only
        return get_rate(*static_cast<v4l2_streamparm*>(argument));
      case VIDIOC_G_CTRL:
        return get_control(*static_cast<v4l2_control*>(argument));
      case VIDIOC_REQBUFS:
        return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
      case VIDIOC_QUERYBUF:
        return query_buffer(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF:
        return queued.insert(static_cast<v4l2_buffer*>(argument)->index).second ? 0 : -EINVAL;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        streaming = !queued.empty();
        return streaming ? 0 : -EINVAL;
      case VIDIOC_STREAMOFF:
        streaming = false;
        return 0;
      default:
        return -ENOTTY;
    }
  }

  void* map(int descriptor, std::size_t bytes, std::int64_t offset) override {
    const auto index = static_cast<std::size_t>(offset / kOffset);
    if (descriptor != descriptor_ || index >= buffers_.size() || bytes != buffers_[index].size()) {
      return nullptr;
    }
    ++mapped;
    return buffers_[index].data();
  }

  void unmap(void* /*memory*/, std::size_t /*bytes*/) override { --mapped; }

  int wait(int descriptor, int timeout_ms) override {
    if (descriptor != descriptor_ || !streaming) {
      return POLLERR;
    }
    if (!plugged) {
      return POLLERR | POLLHUP;
    }
    if (frames.empty() && dequeue_error == 0) {
      sleep_ms(timeout_ms);
      return 0;
    }
    return POLLIN;
  }

  std::int64_t now_ns() override { return now; }
  std::int64_t system_ahead_ns() override { return ahead; }
  void sleep_ms(int duration_ms) override { now += std::int64_t{duration_ms} * 1'000'000; }
  std::vector<std::string> devices() override {
    return plugged ? std::vector<std::string>{path} : std::vector<std::string>{};
  }

  /// A frame of this sequence number that was stamped `age_ms` ago.
  void send(std::uint32_t sequence, std::vector<std::uint8_t> data, int age_ms = 5) {
    now += 100'000'000;
    frames.push_back({.data = std::move(data),
                      .stamp_ns = now - std::int64_t{age_ms} * 1'000'000,
                      .sequence = sequence});
  }
  [[nodiscard]] std::vector<std::uint8_t> pixels(std::uint8_t value) const {
    return std::vector<std::uint8_t>(format.sizeimage, value);
  }

 private:
  static constexpr std::int64_t kOffset = 1 << 20;

  static v4l2_pix_format pixel_format(std::uint32_t code, std::uint32_t width,
                                      std::uint32_t height) {
    v4l2_pix_format format{};
    format.pixelformat = code;
    format.width = width;
    format.height = height;
    return format;
  }

  int query_capability(v4l2_capability& out) const {
    out = {};
    std::memcpy(out.card, "Fake camera", 11);
    std::memcpy(out.bus_info, "usb-1", 5);
    out.capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_META_CAPTURE;  // of all its device files
    out.device_caps = capabilities;
    return 0;
  }

  int enumerate(v4l2_fmtdesc& out) const {
    if (out.index >= codes.size()) {
      return -EINVAL;
    }
    out.pixelformat = codes[out.index];
    return 0;
  }

  int enumerate(v4l2_frmsizeenum& out) const {
    if (out.index >= sizes.size()) {
      return -EINVAL;
    }
    out.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    out.discrete.width = sizes[out.index].width;
    out.discrete.height = sizes[out.index].height;
    return 0;
  }

  int set_format(v4l2_pix_format& wanted) {
    if (streaming) {
      return -EBUSY;
    }
    const bool has = std::any_of(sizes.begin(), sizes.end(), [&](const Size& size) {
      return size.width == wanted.width && size.height == wanted.height;
    });
    if (!has) {
      wanted.width = sizes.front().width;
      wanted.height = sizes.front().height;
    }
    const std::uint32_t pixel_bytes = wanted.pixelformat == V4L2_PIX_FMT_YUYV ? 2 : 1;
    const bool compressed = wanted.pixelformat == V4L2_PIX_FMT_MJPEG;
    wanted.bytesperline = compressed ? 0 : wanted.width * pixel_bytes + padding;
    wanted.sizeimage = compressed ? 4096 : wanted.bytesperline * wanted.height;
    format = wanted;
    return 0;
  }

  int get_rate(v4l2_streamparm& out) const {
    out.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
    out.parm.capture.timeperframe = {.numerator = 1, .denominator = fps};
    return 0;
  }

  int get_control(v4l2_control& out) const {
    const auto found = controls.find(out.id);
    if (found == controls.end()) {
      return -EINVAL;
    }
    out.value = found->second;
    return 0;
  }

  int request_buffers(v4l2_requestbuffers& out) {
    out.count = std::min(out.count, most_buffers);
    buffers_.assign(out.count, std::vector<std::uint8_t>(format.sizeimage));
    return 0;
  }

  int query_buffer(v4l2_buffer& out) const {
    if (out.index >= buffers_.size()) {
      return -EINVAL;
    }
    out.length = static_cast<std::uint32_t>(buffers_[out.index].size());
    out.m.offset = static_cast<std::uint32_t>(out.index * kOffset);
    return 0;
  }

  int dequeue(v4l2_buffer& out) {
    if (dequeue_error != 0) {
      return -dequeue_error;
    }
    if (frames.empty() || queued.empty()) {
      return -EAGAIN;
    }
    const Frame frame = frames.front();
    frames.pop_front();
    out.index = *queued.begin();
    queued.erase(queued.begin());
    auto& buffer = buffers_[out.index];
    std::copy_n(frame.data.begin(), std::min(frame.data.size(), buffer.size()), buffer.begin());
    out.bytesused = static_cast<std::uint32_t>(frame.data.size());
    out.sequence = frame.sequence;
    out.flags = frame.flags;
    out.timestamp.tv_sec = frame.stamp_ns / 1'000'000'000;
    out.timestamp.tv_usec = frame.stamp_ns % 1'000'000'000 / 1000;
    return 0;
  }

  int descriptor_ = -1;
  std::vector<std::vector<std::uint8_t>> buffers_;
};

}  // namespace topoloc::camera
