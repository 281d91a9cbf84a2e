// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/drive.hpp"

#include "topoloc/can/candump.hpp"

#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

namespace topoloc::drive {
namespace {

void require_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw std::runtime_error(file.string() +
                             ": no such file (a drive folder has it, see "
                             "docs/drive-folder.md)");
  }
}

/// "can0 with ids 100 101, can1 with ids 7FF": the first few of each.
std::string listed(const std::map<std::string, std::set<std::uint32_t>>& ids_by_interface) {
  constexpr int kMost = 20;
  std::ostringstream text;
  for (const auto& [interface, ids] : ids_by_interface) {
    text << (text.tellp() > 0 ? ", " : "") << interface << " with ids" << std::hex
         << std::uppercase;
    int shown = 0;
    for (const std::uint32_t id : ids) {
      if (++shown > kMost) {
        text << " ...";
        break;
      }
      text << ' ' << id;
    }
  }
  return text.str();
}

/// A drive has one time line: of a clock that was set back, only what is later than all before.
template <typename Sample>
bool append_later(std::vector<Sample>& samples, const std::optional<Sample>& sample) {
  const bool later = sample && (samples.empty() || samples.back().time_ns < sample->time_ns);
  if (later) {
    samples.push_back(*sample);
  }
  return later || !sample;
}

void read_can_log(const std::filesystem::path& file, Drive& drive) {
  can::VehicleSignals signals(drive.vehicle.can);
  can::CandumpReader reader(file);
  can::Frame frame;
  std::uint64_t before_last = 0;
  std::map<std::string, std::set<std::uint32_t>> seen;  // ids by interface
  while (reader.next(frame)) {
    if (drive.imu.empty()) {
      seen[std::string(frame.interface())].insert(frame.id);
    }
    const can::VehicleSamples samples = signals.feed(frame);
    before_last += append_later(drive.imu, samples.imu) ? 0 : 1;
    before_last += append_later(drive.speed, samples.speed) ? 0 : 1;
  }
  drive.can_frames = reader.frame_count();
  drive.lost_messages = signals.lost_messages();
  drive.first_malformed_line = reader.first_error();
  if (reader.malformed_count() > 0) {
    drive.rejected["malformed line"] = reader.malformed_count();
  }
  for (std::size_t i = 0; i < can::kSignalRejectCount; ++i) {
    const auto reason = static_cast<can::SignalReject>(i);
    if (signals.rejected(reason) > 0) {
      drive.rejected[std::string(can::name(reason))] = signals.rejected(reason);
    }
  }
  if (before_last > 0) {
    drive.rejected["clock set back"] = before_last;
  }
  if (drive.imu.empty()) {
    std::string why;
    for (const auto& [reason, count] : drive.rejected) {
      why += ", " + reason + " " + std::to_string(count);
    }
    throw std::runtime_error(file.string() + ": no IMU sample in " +
                             std::to_string(drive.can_frames) + " frames" + why +
                             (seen.empty() ? "" : "; the log has " + listed(seen)) +
                             " (interface and signals: `can` in vehicle.yaml)");
  }
}

}  // namespace

Drive load_drive(const std::filesystem::path& dir, const std::filesystem::path& vehicle) {
  if (!std::filesystem::is_directory(dir)) {
    throw std::runtime_error(dir.string() + ": no such drive folder");
  }
  Drive drive;
  drive.dir = dir;
  drive.vehicle = config::load_vehicle_config(vehicle.empty() ? dir / "vehicle.yaml" : vehicle);
  require_file(dir / "can.log");
  read_can_log(dir / "can.log", drive);
  if (const auto truth = dir / "ground_truth.tum"; std::filesystem::exists(truth)) {
    drive.ground_truth = evaluation::read_tum(truth);
  }
  return drive;
}

FrameLog open_frames(const Drive& drive) {
  const config::CameraConfig& camera = drive.vehicle.camera;
  if (!camera.configured()) {
    throw std::runtime_error(drive.dir.string() +
                             ": images are needed, but vehicle.yaml has no section 'camera'");
  }
  const PinholeCamera& pinhole = camera.kalibr.calibration.pinhole;
  require_file(drive.dir / "camera.lcm");
  return {drive.dir / "camera.lcm", camera.channel, cv::Size(pinhole.width_px, pinhole.height_px),
          camera.kalibr.time_offset_ns};
}

cv::Mat read_mask(const config::CameraConfig& camera) {
  if (camera.mask.empty()) {
    return {};
  }
  cv::Mat mask = cv::imread(camera.mask.string(), cv::IMREAD_GRAYSCALE);
  if (mask.empty()) {
    throw std::runtime_error(camera.mask.string() + ": the camera mask cannot be read");
  }
  const PinholeCamera& pinhole = camera.kalibr.calibration.pinhole;
  if (mask.size() != cv::Size(pinhole.width_px, pinhole.height_px)) {
    throw std::runtime_error(camera.mask.string() + ": the camera mask is " +
                             std::to_string(mask.cols) + "x" + std::to_string(mask.rows) +
                             ", the calibration says " + std::to_string(pinhole.width_px) + "x" +
                             std::to_string(pinhole.height_px));
  }
  return mask;
}

}  // namespace topoloc::drive
