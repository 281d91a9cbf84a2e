// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/simulate.hpp"

#include "topoloc/can/candump.hpp"
#include "topoloc/simulation/drive_files.hpp"
#include "topoloc/simulation/world_file.hpp"

#include "simulation/scenario_json.hpp"

#include <chrono>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>

namespace topoloc::simulation {
namespace {

namespace fs = std::filesystem;
using Part = DriveSpec::Part;

constexpr double kReference_hz = 100.0;

/// Poses of the IMU at drive times, every 10 ms.
evaluation::Trajectory reference(const Ego& ego, const DriveSpec& spec) {
  evaluation::Trajectory truth;
  const auto count = static_cast<std::int64_t>(std::floor(ego.duration_s() * kReference_hz));
  for (std::int64_t i = 0; i <= count; ++i) {
    const double time_s = static_cast<double>(i) / kReference_hz;
    truth.push_back({spec.begin_ns + std::llround(time_s * 1e9),
                     ego.trajectory.at(time_s).T_world_body * spec.built.T_vehicle_imu});
  }
  return truth;
}

void describe_motion(const Ego& ego, DriveSummary& summary) {
  summary.duration_s = ego.duration_s();
  constexpr double kStep_s = 0.05;
  constexpr double kStanding_mps = 0.01;
  const auto steps = static_cast<int>(std::floor(ego.duration_s() / kStep_s));
  for (int i = 0; i < steps; ++i) {
    const BodyMotion motion = ego.trajectory.at(i * kStep_s);
    const double speed = motion.velocity_mps.norm();
    const bool backwards = motion.velocity_mps.dot(motion.T_world_body.R.col(0)) < 0.0;
    summary.way_m += speed * kStep_s;
    summary.reversed_m += backwards && speed > kStanding_mps ? speed * kStep_s : 0.0;
    summary.standing_s += speed < kStanding_mps ? kStep_s : 0.0;
  }
}

void write_sensors(const Ego& ego, const world::World& world, const DriveSpec& spec,
                   const fs::path& folder, DriveSummary& summary) {
  const auto imu =
      sense_motion(ego.trajectory, spec.built.T_vehicle_imu, spec.imu, spec.key(Part::kImu));
  const auto wheels =
      sense_wheels(ego.trajectory, spec.ego.vehicle, spec.wheels, spec.key(Part::kWheels));
  can::CandumpWriter log(folder / "can.log");
  for (const can::Frame& frame :
       put_on_bus(imu, wheels, spec.begin_ns, spec.bus, spec.key(Part::kBus))) {
    log.write(frame);
  }
  log.close();
  summary.imu_samples = imu.size();
  summary.wheel_samples = wheels.size();

  evaluation::Trajectory fixes = sense_satellites(ego, spec.built.T_vehicle_imu, world.route,
                                                  spec.gnss, spec.key(Part::kGnss));
  for (evaluation::StampedPose& fix : fixes) {
    fix.time_ns += spec.begin_ns;
  }
  summary.gnss_fixes = fixes.size();
  if (!fixes.empty()) {  // else all of it is tunnel
    evaluation::write_tum(folder / "gnss.tum", fixes);
  }
  const evaluation::Trajectory truth = reference(ego, spec);
  evaluation::write_tum(folder / "ground_truth.tum", truth);
  if (spec.request.mapping) {
    evaluation::write_tum(folder / "prior.tum",
                          disturbed(truth, spec.prior, spec.key(Part::kPrior)));
  }
}

SurveyCounts write_cloud(rendering::Raycaster& raycaster, const Ego& ego, const world::Visit& visit,
                         const DriveSpec& spec, const fs::path& folder,
                         const std::function<void(double)>& progress) {
  LazWriter laz(folder / "cloud.laz");
  std::optional<PlyWriter> ply;
  if (spec.request.ply) {
    ply.emplace(folder / "cloud.ply");
  }
  const auto write = [&](const SurveyPoint& point) {
    laz.write(point);
    if (ply) {
      ply->write(point);
    }
  };
  const SurveyCounts counts = survey(raycaster, ego, visit, spec.built.T_vehicle_lidar, spec.survey,
                                     spec.begin_ns, spec.key(Part::kSurvey), write, progress);
  laz.close();
  if (ply) {
    ply->close();
  }
  return counts;
}

/// Runs a stage and notes how long it took.
class Stages {
 public:
  Stages(DriveSummary& summary, const StageProgress& progress)
      : summary_(&summary), progress_(&progress) {}

  template <typename Work>
  void run(const std::string& stage, Work&& work) {
    const auto begin = std::chrono::steady_clock::now();
    const std::function<void(double)> progress = [&](double share) {
      if (*progress_) {
        (*progress_)(stage, share);
      }
    };
    progress(0.0);
    work(progress);
    progress(1.0);
    summary_->stage_s[stage] =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

 private:
  DriveSummary* summary_;
  const StageProgress* progress_;
};

}  // namespace

DriveSummary simulate_drive(const DriveRequest& request, const fs::path& folder,
                            const StageProgress& progress) {
  using Progress = std::function<void(double)>;
  const DriveSpec spec = drive_spec(request);
  DriveSummary summary;
  Stages stages(summary, progress);
  std::optional<world::World> world;
  std::optional<world::Visit> visit;
  std::optional<rendering::Raycaster> raycaster;
  const bool surveyed = request.mapping && request.cloud;
  stages.run("world", [&](const Progress&) {
    world.emplace(world::make_world(request.world));
    visit.emplace(*world, spec.visit);
    if (request.images || surveyed) {
      raycaster.emplace(*world, visit->parked());
    }
  });
  const Road road = road_of(*world);
  const Ego ego = drive_along(road, spec.ego, spec.key(Part::kEgo));
  summary.road_m = world->route.length_m();
  describe_motion(ego, summary);
  stages.run("sensors", [&](const Progress&) {
    write_world_file(folder / "world.yaml", request.world);
    write_vehicle_files(folder, spec);
    write_sensors(ego, *world, spec, folder, summary);
  });
  if (surveyed) {
    stages.run("cloud", [&](const Progress& share) {
      summary.survey = write_cloud(*raycaster, ego, *visit, spec, folder, share);
    });
  }
  if (request.images) {
    stages.run("images", [&](const Progress& share) {
      summary.camera = film(*raycaster, ego, *visit, spec.built.T_vehicle_cam, spec.camera,
                            request.light, spec.camera_log, spec.begin_ns, spec.key(Part::kCamera),
                            folder / "camera.lcm", share);
    });
  }
  std::ofstream scenario(folder / "scenario.json");
  scenario << scenario_json(spec, summary);
  scenario.close();
  if (!scenario) {
    throw std::runtime_error((folder / "scenario.json").string() + ": cannot write");
  }
  return summary;
}

}  // namespace topoloc::simulation
