// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_form.hpp"
#include "topoloc/camera/pixel_layout.hpp"
#include "topoloc/camera/video_calls.hpp"
#include "topoloc/image_t.hpp"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace topoloc::camera {

/// The device is not there, not usable as asked for, or gone. The message names it and says what to
/// do.
class CameraError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What is asked of a camera; what is left open stays as it is set.
struct CameraRequest {
  std::string device;
  std::optional<int> width_px;
  std::optional<int> height_px;
  std::optional<double> fps;
  std::optional<PixelLayout> layout;
  /// Used where the camera has no exposure control, or chooses the exposure by itself: what it then
  /// says of it may be old.
  std::optional<std::int64_t> exposure_ns;
  std::int64_t stamp_offset_ns = 0;
  bool stamp_on_arrival = false;  ///< instead of the driver's stamps
};

/// What it does.
struct CameraMode {
  PixelLayout layout = PixelLayout::kGrey;
  std::uint32_t code = 0;  ///< V4L2's, of the layout
  ImageSize size;
  std::size_t stride_bytes = 0;
  double fps = 0.0;  ///< 0: it does not say
};

enum class Capture : std::uint8_t {
  kImage,
  kTimeout,
  kDamaged,   ///< marked so by the driver, too short, or no JPEG of the camera's size
  kBadStamp,  ///< in the future, older than 5 s, or not later than the one before
};

/// A V4L2 camera (single-planar capture) that streams into memory-mapped buffers, from construction
/// to destruction.
///
/// The driver's stamps are of the start of the exposure or of the end of the frame, as it says, on
/// CLOCK_MONOTONIC; they are brought to mid-exposure and Unix time. Where a driver stamps by
/// another clock, the time of arrival is taken as the end of the frame.
class V4l2Camera {
 public:
  /// Opens, sets and starts it. Throws CameraError. `calls` outlives this.
  V4l2Camera(VideoCalls& calls, const CameraRequest& request);
  ~V4l2Camera();
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  [[nodiscard]] const CameraMode& mode() const { return mode_; }
  /// What the user should know about how it works: one line each.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  /// The next image, complete, if there is one within the time. Throws CameraError where the device
  /// has gone or fails.
  Capture capture(image_t& image, int timeout_ms);

  /// Gaps in the driver's numbers of the frames.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  /// Stamped by arrival.
  [[nodiscard]] std::uint64_t stamped_on_arrival() const { return stamped_on_arrival_; }

 private:
  struct Buffer {
    void* memory = nullptr;
    std::size_t bytes = 0;
  };
  struct Exposure {
    std::int64_t time_ns = 0;
    std::int64_t read_ns = 0;  ///< when that was
    bool automatic = false;
    bool known = false;
  };
  /// A frame as the driver hands it over.
  struct Dequeued;

  void start();
  void stop();
  void check_capabilities();
  void set_format();
  void set_rate();
  void queue_buffers();
  void read_exposure();
  [[nodiscard]] std::optional<std::int32_t> control_value(std::uint32_t id);
  bool dequeue(Dequeued& frame);
  void queue(std::uint32_t index);
  [[nodiscard]] Capture take(const Dequeued& frame, image_t& image);
  [[nodiscard]] bool take_pixels(const Dequeued& frame, image_t& image);
  [[nodiscard]] bool take_time(const Dequeued& frame, image_t& image);
  [[noreturn]] void fail(const std::string& what, int error) const;

  VideoCalls& calls_;
  CameraRequest request_;
  int descriptor_ = -1;
  CameraMode mode_;
  std::vector<Buffer> buffers_;
  bool streaming_ = false;
  Exposure exposure_;
  std::vector<std::string> warnings_;
  std::optional<std::uint32_t> last_sequence_;
  std::int64_t last_stamp_ns_;
  std::uint64_t dropped_ = 0;
  std::uint64_t stamped_on_arrival_ = 0;
};

}  // namespace topoloc::camera
