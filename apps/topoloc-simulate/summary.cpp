// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "summary.hpp"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

using topoloc::simulation::DriveRequest;
using topoloc::simulation::DriveSummary;

std::string to_text(const DriveSummary& summary) {
  std::string text = fmt::format(
      "drive     {:.0f} m in {:.1f} s ({:.1f} m backwards, {:.1f} s standing)\n"
      "sensors   {} IMU samples, {} wheel samples, {} GNSS fixes\n",
      summary.way_m, summary.duration_s, summary.reversed_m, summary.standing_s,
      summary.imu_samples, summary.wheel_samples, summary.gnss_fixes);
  if (summary.survey.scans > 0) {
    text += fmt::format("cloud     {} points of {} returns in {} scans, {} on moving vehicles\n",
                        summary.survey.points, summary.survey.returns, summary.survey.scans,
                        summary.survey.moving_points);
  }
  if (summary.camera.frames > 0) {
    text += fmt::format("images    {} frames, {:.1f} MB\n", summary.camera.frames,
                        static_cast<double>(summary.camera.bytes) * 1e-6);
  }
  std::string times;
  for (const auto& [stage, seconds] : summary.stage_s) {
    times += fmt::format("{}{} {:.1f} s", times.empty() ? "" : ", ", stage, seconds);
  }
  return text + "took      " + times + "\n";
}

std::string to_json(const DriveRequest& request, const DriveSummary& summary) {
  nlohmann::ordered_json json = {{"scenario", topoloc::world::name(request.world.scenario)},
                                 {"world_seed", request.world.seed},
                                 {"seed", request.seed},
                                 {"light", topoloc::rendering::name(request.light)},
                                 {"mapping", request.mapping},
                                 {"road_m", summary.road_m},
                                 {"duration_s", summary.duration_s},
                                 {"way_m", summary.way_m},
                                 {"reversed_m", summary.reversed_m},
                                 {"standing_s", summary.standing_s},
                                 {"imu_samples", summary.imu_samples},
                                 {"wheel_samples", summary.wheel_samples},
                                 {"gnss_fixes", summary.gnss_fixes},
                                 {"frames", summary.camera.frames},
                                 {"image_bytes", summary.camera.bytes},
                                 {"scans", summary.survey.scans},
                                 {"returns", summary.survey.returns},
                                 {"points", summary.survey.points},
                                 {"moving_points", summary.survey.moving_points},
                                 {"stage_s", summary.stage_s}};
  return json.dump(2) + "\n";
}
