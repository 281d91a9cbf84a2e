// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/transport/image_view.hpp"
#include "topoloc/transport/lcm_log.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

namespace topoloc::drive {

/// Why a logged image is not a frame.
enum class FrameReject : std::uint8_t {
  kBadMessage,        ///< no valid image_t (transport::ImageVerdict)
  kWrongSize,         ///< not the size of the calibration
  kNonMonotonicTime,  ///< not later than the frame before it
  kUndecodable,       ///< JPEG data that does not decode to the stated size
};
inline constexpr std::size_t kFrameRejectCount = 4;
std::string_view name(FrameReject reason);

/// The camera frames of an LCM event log, in time order, decoded on demand.
class FrameLog {
 public:
  /// Reads the headers of all messages on `channel`. `time_offset_ns` is added to every time stamp
  /// (Kalibr's timeshift_cam_imu: t_imu = t_cam + offset). Frames that are not `size` are rejected.
  /// Throws std::runtime_error where the file cannot be read or has no usable frame on `channel`.
  FrameLog(const std::filesystem::path& file, std::string_view channel, cv::Size size,
           std::int64_t time_offset_ns);

  [[nodiscard]] std::size_t size() const { return frames_.size(); }
  /// Mid-exposure, IMU clock. Strictly increasing.
  [[nodiscard]] std::int64_t time_ns(std::size_t index) const { return frames_.at(index).time_ns; }
  /// As it was logged; points into the file, valid as long as this log.
  [[nodiscard]] transport::LogEvent message(std::size_t index) const {
    return log_.event(frames_.at(index).event);
  }
  /// CV_8UC1 of the size given; empty where the data does not decode, which is counted (once per
  /// call) as kUndecodable. Not thread-safe for that reason.
  [[nodiscard]] cv::Mat grey(std::size_t index);

  [[nodiscard]] std::uint64_t rejected(FrameReject reason) const {
    return rejected_[static_cast<std::size_t>(reason)];
  }
  /// The same by name; reasons that did not occur are left out.
  [[nodiscard]] std::map<std::string, std::uint64_t> rejected() const;
  /// First rejection in words, with file and message number; empty if there was none.
  [[nodiscard]] const std::string& first_error() const { return first_error_; }
  [[nodiscard]] const transport::LogDamage& damage() const { return log_.damage(); }

 private:
  struct Frame {
    std::int64_t time_ns;
    std::size_t event;
  };
  void reject(FrameReject reason, std::size_t event, std::string_view what);

  std::filesystem::path file_;
  transport::LcmLogReader log_;
  cv::Size size_;
  std::vector<Frame> frames_;
  std::array<std::uint64_t, kFrameRejectCount> rejected_{};
  std::string first_error_;
};

}  // namespace topoloc::drive
