// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_source.hpp"
#include "topoloc/camera/v4l2_camera.hpp"
#include "topoloc/camera/video_calls.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace topoloc::camera {

/// A camera that may be unplugged and plugged in again, or get stuck: it is closed and, twice a
/// second, tried again, with the size and format that it had at first.
class V4l2Source final : public ImageSource {
 public:
  /// Throws CameraError if the camera cannot be used now.
  V4l2Source(VideoCalls& calls, const CameraRequest& request, Report report);

  [[nodiscard]] const CameraMode& mode() const { return mode_; }
  Taken next(image_t& image) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> losses() const override;

 private:
  void open();
  void reopen();
  void close(const std::string& why);
  [[nodiscard]] bool is_stuck() const;

  VideoCalls& calls_;
  CameraRequest request_;
  Report report_;
  std::unique_ptr<V4l2Camera> camera_;
  CameraMode mode_;
  std::int64_t last_image_ns_ = 0;
  std::int64_t retry_ns_ = 0;
  std::string last_problem_;

  std::uint64_t dropped_ = 0;  // by cameras that were closed
  std::uint64_t stamped_on_arrival_ = 0;
  std::uint64_t damaged_ = 0;
  std::uint64_t bad_stamps_ = 0;
  std::uint64_t interruptions_ = 0;
};

}  // namespace topoloc::camera
