// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/v4l2_camera.hpp"

#include "topoloc/camera/exposure_time.hpp"

#include "camera/camera_errors.hpp"
#include "camera/v4l2_formats.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <linux/videodev2.h>
#include <poll.h>
#include <span>

#include <fmt/core.h>

namespace topoloc::camera {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

struct V4l2Camera::Dequeued {
  v4l2_buffer buffer{};
  std::int64_t arrival_ns = 0;  // CLOCK_MONOTONIC
};

V4l2Camera::V4l2Camera(VideoCalls& calls, const CameraRequest& request)
    : calls_(calls), request_(request), last_stamp_ns_(std::numeric_limits<std::int64_t>::min()) {
  try {
    start();
  } catch (...) {
    stop();
    throw;
  }
}

V4l2Camera::~V4l2Camera() { stop(); }

void V4l2Camera::fail(const std::string& what, int error) const {
  throw CameraError(camera_error_text(request_.device, what, error));
}

void V4l2Camera::start() {
  descriptor_ = calls_.open(request_.device);
  if (descriptor_ < 0) {
    fail("cannot be opened", -descriptor_);
  }
  check_capabilities();
  set_format();
  set_rate();
  queue_buffers();
  read_exposure();
  if (!exposure_.known && !request_.stamp_on_arrival) {
    warnings_.push_back(request_.device +
                        ": does not tell its exposure time: give --exposure-ms, else stamps are of "
                        "the edge of the exposure, not of its middle");
  } else if (exposure_.automatic && !request_.exposure_ns) {
    warnings_.push_back(
        request_.device +
        ": chooses its exposure by itself, and what it says of it may be old: set it to manual "
        "(v4l2-ctl -d DEVICE -c auto_exposure=1,exposure_time_absolute=...) or give --exposure-ms");
  }
  auto type = kCapture;
  if (const int error = calls_.control(descriptor_, VIDIOC_STREAMON, &type); error < 0) {
    fail("does not start to stream", -error);
  }
  streaming_ = true;
}

void V4l2Camera::stop() {
  if (streaming_) {
    auto type = kCapture;
    calls_.control(descriptor_, VIDIOC_STREAMOFF, &type);
    streaming_ = false;
  }
  for (const Buffer& buffer : buffers_) {
    calls_.unmap(buffer.memory, buffer.bytes);
  }
  buffers_.clear();
  if (descriptor_ >= 0) {
    calls_.close(descriptor_);
    descriptor_ = -1;
  }
}

void V4l2Camera::check_capabilities() {
  v4l2_capability capability{};
  if (const int error = calls_.control(descriptor_, VIDIOC_QUERYCAP, &capability); error < 0) {
    fail("is no V4L2 device", -error);
  }
  const std::uint32_t has = device_capabilities(capability);
  if ((has & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    fail((has & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
             ? "has the multi-planar interface only, which topoloc-camera does not know"
             : "gives no images (a camera often has a second device for metadata: topoloc-camera "
               "--list shows those that do)",
         0);
  }
  if ((has & V4L2_CAP_STREAMING) == 0) {
    fail("has no streaming I/O", 0);
  }
}

void V4l2Camera::set_format() {
  const std::vector<std::uint32_t> codes = format_codes(calls_, descriptor_);
  const auto layout = choose_layout(codes, request_.layout);
  if (!layout) {
    std::string offered;
    for (const std::uint32_t code : codes) {
      offered += (offered.empty() ? "" : ", ") + fourcc_text(code);
    }
    fail(fmt::format("has no {}; it offers: {}",
                     request_.layout ? fourcc_text(fourcc(*request_.layout)) + " images"
                                     : std::string("format of GREY, MJPG and YUYV"),
                     offered.empty() ? "nothing" : offered),
         0);
  }
  v4l2_format format{};
  format.type = kCapture;
  if (const int error = calls_.control(descriptor_, VIDIOC_G_FMT, &format); error < 0) {
    fail("does not tell its format", -error);
  }
  const int width_px = request_.width_px.value_or(static_cast<int>(format.fmt.pix.width));
  const int height_px = request_.height_px.value_or(static_cast<int>(format.fmt.pix.height));
  format.fmt.pix.width = static_cast<std::uint32_t>(width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(height_px);
  format.fmt.pix.pixelformat = code_of(*layout, codes);
  format.fmt.pix.field = V4L2_FIELD_ANY;
  format.fmt.pix.bytesperline = 0;  // the driver's choice
  format.fmt.pix.sizeimage = 0;
  const std::uint32_t code = format.fmt.pix.pixelformat;
  if (const int error = calls_.control(descriptor_, VIDIOC_S_FMT, &format); error < 0) {
    fail(fmt::format("does not take {} of {}x{}", fourcc_text(code), width_px, height_px), -error);
  }
  // A driver takes what comes nearest.
  const v4l2_pix_format& set = format.fmt.pix;
  if (set.pixelformat != code || set.width != static_cast<std::uint32_t>(width_px) ||
      set.height != static_cast<std::uint32_t>(height_px)) {
    fail(fmt::format("has no {} of {}x{}, the nearest is {} of {}x{}; it offers: {}",
                     fourcc_text(code), width_px, height_px, fourcc_text(set.pixelformat),
                     set.width, set.height, sizes_text(calls_, descriptor_, code)),
         0);
  }
  const std::size_t pixel_bytes = *layout == PixelLayout::kYuyv ? 2 : 1;
  mode_ = {.layout = *layout,
           .code = code,
           .size = {.width_px = width_px, .height_px = height_px},
           .stride_bytes = set.bytesperline != 0 ? set.bytesperline
                                                 : pixel_bytes * static_cast<std::size_t>(width_px),
           .fps = 0.0};
}

void V4l2Camera::set_rate() {
  v4l2_streamparm parameters{};
  parameters.type = kCapture;
  const bool told = calls_.control(descriptor_, VIDIOC_G_PARM, &parameters) >= 0;
  v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (request_.fps) {
    if (!told || (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) == 0) {
      warnings_.push_back(request_.device + ": its rate cannot be set; --fps is not in effect");
    } else {
      constexpr std::uint32_t kDenominator = 1000;
      period.numerator = kDenominator;
      period.denominator = static_cast<std::uint32_t>(std::lround(*request_.fps * kDenominator));
      if (const int error = calls_.control(descriptor_, VIDIOC_S_PARM, &parameters); error < 0) {
        fail(fmt::format("does not take {:g} images a second", *request_.fps), -error);
      }
    }
  }
  if (told && period.numerator != 0 && period.denominator != 0) {
    mode_.fps = static_cast<double>(period.denominator) / period.numerator;
    constexpr double kTolerance = 0.01;
    if (request_.fps && std::abs(mode_.fps - *request_.fps) > kTolerance * *request_.fps) {
      warnings_.push_back(fmt::format("{}: gives {:.2f} images a second instead of {:g}",
                                      request_.device, mode_.fps, *request_.fps));
    }
  }
}

void V4l2Camera::queue_buffers() {
  constexpr std::uint32_t kWanted = 4;
  constexpr std::uint32_t kLeast = 2;
  v4l2_requestbuffers request{};
  request.count = kWanted;
  request.type = kCapture;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = calls_.control(descriptor_, VIDIOC_REQBUFS, &request); error < 0) {
    fail("does not give buffers", -error);
  }
  if (request.count < kLeast) {
    fail("gives less than two buffers", 0);
  }
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.type = kCapture;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (const int error = calls_.control(descriptor_, VIDIOC_QUERYBUF, &buffer); error < 0) {
      fail("does not tell where its buffers are", -error);
    }
    void* memory = calls_.map(descriptor_, buffer.length, buffer.m.offset);
    if (memory == nullptr) {
      fail("its buffers cannot be mapped", 0);
    }
    buffers_.push_back({memory, buffer.length});
    queue(index);
  }
}

void V4l2Camera::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = kCapture;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  if (const int error = calls_.control(descriptor_, VIDIOC_QBUF, &buffer); error < 0) {
    fail("does not take its buffer back", -error);
  }
}

std::optional<std::int32_t> V4l2Camera::control_value(std::uint32_t id) {
  v4l2_control control{.id = id, .value = 0};
  if (calls_.control(descriptor_, VIDIOC_G_CTRL, &control) < 0) {
    return std::nullopt;
  }
  return control.value;
}

void V4l2Camera::read_exposure() {
  constexpr std::int64_t kUnit_ns = 100'000;  // of the control
  exposure_.read_ns = calls_.now_ns();
  const auto automatic = control_value(V4L2_CID_EXPOSURE_AUTO);
  exposure_.automatic = automatic && *automatic != V4L2_EXPOSURE_MANUAL &&
                        *automatic != V4L2_EXPOSURE_SHUTTER_PRIORITY;
  const auto told = control_value(V4L2_CID_EXPOSURE_ABSOLUTE);
  if (told && *told > 0 && !(exposure_.automatic && request_.exposure_ns)) {
    exposure_.time_ns = *told * kUnit_ns;
    exposure_.known = true;
  } else if (request_.exposure_ns) {
    exposure_.time_ns = *request_.exposure_ns;
    exposure_.known = true;
  }
}

Capture V4l2Camera::capture(image_t& image, int timeout_ms) {
  const int events = calls_.wait(descriptor_, timeout_ms);
  if (events < 0) {
    fail("cannot be waited for", -events);
  }
  if (events == 0) {
    return Capture::kTimeout;
  }
  Dequeued frame;
  if (!dequeue(frame)) {
    if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
      fail("stopped, or was unplugged", 0);
    }
    return Capture::kTimeout;
  }
  const Capture outcome = take(frame, image);
  queue(frame.buffer.index);
  if (frame.arrival_ns - exposure_.read_ns > kSecond_ns) {
    read_exposure();
  }
  return outcome;
}

bool V4l2Camera::dequeue(Dequeued& frame) {
  frame.buffer.type = kCapture;
  frame.buffer.memory = V4L2_MEMORY_MMAP;
  const int error = calls_.control(descriptor_, VIDIOC_DQBUF, &frame.buffer);
  if (error == -EAGAIN) {
    return false;
  }
  if (error < 0) {
    fail("gives no more images", -error);
  }
  frame.arrival_ns = calls_.now_ns();
  if (frame.buffer.index >= buffers_.size()) {
    fail("hands over a buffer that it does not have", 0);
  }
  return true;
}

Capture V4l2Camera::take(const Dequeued& frame, image_t& image) {
  const std::uint32_t sequence = frame.buffer.sequence;
  if (last_sequence_) {
    // Numbers wrap; one that goes back is a driver's new count, not four thousand million frames.
    const auto ahead = static_cast<std::int32_t>(sequence - *last_sequence_);
    dropped_ += ahead > 1 ? static_cast<std::uint64_t>(ahead - 1) : 0;
  }
  last_sequence_ = sequence;
  if ((frame.buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || !take_pixels(frame, image)) {
    return Capture::kDamaged;
  }
  return take_time(frame, image) ? Capture::kImage : Capture::kBadStamp;
}

bool V4l2Camera::take_pixels(const Dequeued& frame, image_t& image) {
  const Buffer& buffer = buffers_[frame.buffer.index];
  const std::size_t used = std::min<std::size_t>(frame.buffer.bytesused, buffer.bytes);
  const std::span pixels(static_cast<const std::uint8_t*>(buffer.memory), used);
  image.nmetadata = 0;
  image.metadata.clear();
  switch (mode_.layout) {
    case PixelLayout::kMjpeg:
      if (jpeg_size(pixels) != mode_.size) {
        return false;
      }
      image.data.assign(pixels.begin(), pixels.end());
      set_jpeg(image, mode_.size);
      return true;
    case PixelLayout::kGrey:
      if (!pack_rows(pixels, mode_.size, mode_.stride_bytes, image.data)) {
        return false;
      }
      break;
    case PixelLayout::kYuyv:
      if (!yuyv_to_grey(pixels, mode_.size, mode_.stride_bytes, image.data)) {
        return false;
      }
      break;
  }
  set_grey(image, mode_.size);
  return true;
}

bool V4l2Camera::take_time(const Dequeued& frame, image_t& image) {
  constexpr std::int64_t kTooOld_ns = 5 * kSecond_ns;
  const std::uint32_t flags = frame.buffer.flags;
  const bool monotonic =
      (flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::int64_t stamp_ns = frame.arrival_ns;
  ExposureTime time{.point = StampPoint::kEndOfFrame,
                    .exposure_ns = exposure_.time_ns,
                    .offset_ns = request_.stamp_offset_ns};
  if (monotonic && !request_.stamp_on_arrival) {
    const timeval& stamp = frame.buffer.timestamp;
    stamp_ns = stamp.tv_sec * kSecond_ns + stamp.tv_usec * 1000;
    if ((flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE) {
      time.point = StampPoint::kStartOfExposure;
    }
  } else {
    ++stamped_on_arrival_;
  }
  if (stamp_ns > frame.arrival_ns || frame.arrival_ns - stamp_ns > kTooOld_ns ||
      stamp_ns <= last_stamp_ns_) {
    return false;
  }
  last_stamp_ns_ = stamp_ns;
  image.utime = (mid_exposure_ns(stamp_ns, time) + calls_.system_ahead_ns()) / 1000;
  return true;
}

}  // namespace topoloc::camera
