// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/build_settings.hpp"

#include "map/checksum.hpp"

#include <array>
#include <cstdint>
#include <iomanip>
#include <limits>
#include <sstream>

namespace topoloc::mapping {
namespace {

class Description {
 public:
  Description() { text_ << std::setprecision(std::numeric_limits<double>::max_digits10); }

  template <typename... Values>
  void line(const char* key, const Values&... values) {
    text_ << key << ':';
    ((text_ << ' ' << values), ...);
    text_ << '\n';
  }
  void file(const char* key, const std::filesystem::path& path) {
    line(key, std::filesystem::canonical(path), std::filesystem::file_size(path),
         std::filesystem::last_write_time(path).time_since_epoch().count());
  }
  void camera(const char* key, const PinholeCamera& c) {
    line(key, c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px);
  }
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

/// Of frames, times, poses, covariances and verdicts: refinement may find others next time.
std::uint64_t checksum_of_poses(std::span<const PlannedNode> nodes) {
  map::Checksum checksum;
  for (const PlannedNode& node : nodes) {
    const std::array<std::int64_t, 3> integers{static_cast<std::int64_t>(node.frame), node.time_ns,
                                               node.rejected.has_value() ? 1 : 0};
    checksum.update(std::as_bytes(std::span(integers)));
    checksum.update(std::as_bytes(std::span(node.T_world_imu.R.data(), 9)));
    checksum.update(std::as_bytes(std::span(node.T_world_imu.p.data(), 3)));
    checksum.update(std::as_bytes(std::span(node.covariance.data(), 36)));
  }
  return checksum.value();
}

}  // namespace

std::string describe_settings(const BuildPaths& paths, const BuildConfig& config,
                              const config::VehicleConfig& vehicle, const map::MapInfo& info,
                              std::span<const PlannedNode> nodes) {
  Description d;
  // 3: poses by checksum.
  d.line("journal", 3);
  d.line("creator", config.creator);
  d.file("cloud", paths.cloud);
  if (!paths.trajectory.empty()) {
    d.file("trajectory", paths.trajectory);
  }
  d.file("camera log", paths.drive / "camera.lcm");

  const config::CameraConfig& camera = vehicle.camera;
  d.line("channel", camera.channel, camera.kalibr.time_offset_ns);
  d.camera("raw camera", camera.kalibr.calibration.pinhole);
  const auto& k = camera.kalibr.calibration.coefficients;
  d.line("distortion", static_cast<int>(camera.kalibr.calibration.distortion), k[0], k[1], k[2],
         k[3], k[4]);
  d.line("T_imu_cam", info.T_imu_cam.R.reshaped().transpose(), info.T_imu_cam.p.transpose());
  if (!camera.mask.empty()) {
    d.file("mask", camera.mask);
  }

  d.camera("map camera", info.camera);
  d.line("model", map::to_string(info.model), vehicle.matching.max_features,
         vehicle.matching.mask_erosion_px);

  const SelectionConfig& s = config.selection;
  d.line("selection", static_cast<int>(s.frames), s.every_m, s.every_rad, s.max_pose_gap_ns);
  const RenderConfig& r = config.render;
  d.line("render", r.min_depth_m, r.max_depth_m, r.footprint_m, r.min_footprint_px,
         r.max_footprint_px, r.depth_margin_m, r.depth_margin);
  const LiftConfig& l = config.lift;
  d.line("lift", l.min_radius_px, l.max_radius_px, l.min_points, l.touch_radius_px,
         l.surface_tolerance_m, l.surface_tolerance, l.min_surface_share, l.cloud_std_m,
         l.pixel_std_px, l.max_relative_std);
  d.line("nodes", config.trajectory_std_m, config.trajectory_std_rad, config.min_coverage,
         config.min_features, config.min_lifted);
  d.line("poses", checksum_of_poses(nodes));
  return d.text();
}

std::string describe_pose_settings(const BuildPaths& paths, const config::VehicleConfig& vehicle,
                                   const PoseRefiner& refiner) {
  Description d;
  d.file("program", "/proc/self/exe");
  d.file("cloud", paths.cloud);
  if (!paths.trajectory.empty()) {
    d.file("trajectory", paths.trajectory);
  }
  for (const char* const log : {"camera.lcm", "can.log"}) {
    if (std::filesystem::exists(paths.drive / log)) {
      d.file(log, paths.drive / log);
    }
  }
  for (const std::filesystem::path& file : vehicle.files) {
    d.file("vehicle", file);
  }
  for (const std::filesystem::path& file : refiner.files()) {
    d.file("refiner", file);
  }
  return d.text() + refiner.settings();
}

}  // namespace topoloc::mapping
