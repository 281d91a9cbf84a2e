// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/candump.hpp"
#include "topoloc/drive/frame_log.hpp"
#include "topoloc/drive/frame_selection.hpp"
#include "topoloc/replay/camera_faults.hpp"
#include "topoloc/replay/can_faults.hpp"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace topoloc::replay {

/// What a candump log holds, from a pass over it.
struct CanLogSummary {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
  std::map<std::string, std::uint64_t> frames;  ///< by interface
  std::uint64_t malformed = 0;
};

/// The part of a drive that is played, in the drive's own time.
struct DrivePart {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;  ///< not included
  bool loop = false;        ///< played again and again

  /// From one start of a loop to the next. The first frame of a lap follows the last of the lap
  /// before by kSeam_ns: like the one before it, at the usual 100 Hz.
  static constexpr std::int64_t kSeam_ns = 10'000'000;
  [[nodiscard]] std::int64_t lap_ns() const { return end_ns - begin_ns + kSeam_ns; }
};

/// Reads a log from `start_s` after its first frame on, for `duration_s`. Throws
/// std::runtime_error where there is nothing to play, and where the time goes back by more than a
/// second or leaps ahead by more than a minute within the part: a replay needs one time line.
CanLogSummary summarise_can_log(const std::filesystem::path& file, double start_s,
                                double duration_s = std::numeric_limits<double>::infinity());

/// When a logged image reached the log, in ns: mid-exposure plus transfer. Where the log's own
/// stamp is no such time (earlier than mid-exposure, or by more than 5 s later): mid-exposure.
std::int64_t arrival_ns(const transport::LogEvent& event);

/// The CAN frames of a part of a drive, lap after lap, in the order of the log. A frame whose stamp
/// is older than that of the one before is due with that.
class CanTrack {
 public:
  CanTrack(std::filesystem::path file, const DrivePart& part);
  /// False after the last.
  bool next(TimedFrame& out);

 private:
  std::filesystem::path file_;
  DrivePart part_;
  std::unique_ptr<can::CandumpReader> reader_;
  std::int64_t lap_ = 0;
  std::int64_t last_elapsed_ns_ = 0;
  bool any_in_lap_ = false;
};

/// The selected images of a part of a drive, lap after lap.
class CameraTrack {
 public:
  /// The log must outlive it.
  CameraTrack(const drive::FrameLog& log, const DrivePart& part, drive::FrameSelection selection);
  /// False after the last.
  bool next(TimedImage& out);
  /// For CameraFaults::Elsewhere: any image of the log, selected or not.
  [[nodiscard]] std::span<const std::byte> message_at(std::int64_t elapsed_ns) const;

 private:
  const drive::FrameLog* log_;
  DrivePart part_;
  drive::FrameSelection selection_;
  std::size_t index_ = 0;
  std::int64_t lap_ = 0;
  std::int64_t last_elapsed_ns_ = 0;
  bool any_in_lap_ = false;
};

}  // namespace topoloc::replay
