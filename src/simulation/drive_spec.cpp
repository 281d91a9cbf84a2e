// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_spec.hpp"

#include "topoloc/world/random.hpp"

namespace topoloc::simulation {
namespace {

/// Parts of keys, so that nothing shares its random numbers.
enum Stream : std::uint64_t { kCar = 101, kVisit, kDay, kPartBase = 200 };

const Eigen::Vector3d kHeadLamps_m(3.3, 0.0, 0.65);  // in the vehicle's frame, level
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kDay_s = 86'400;
constexpr std::int64_t kFirstDay_s = 1'780'272'000;  // 2026-06-01, UTC

std::uint64_t place_key(const world::WorldSpec& spec) {
  return world::key(spec.seed, {static_cast<std::uint64_t>(spec.scenario)});
}

std::uint64_t drive_key(const DriveRequest& request) {
  // A mapping drive and another day's drive of the same seed are two drives, by another light it is
  // another day, and in another world they are others: else all drives of a suite would share one
  // draw of the sensors' errors.
  return world::key(request.seed, {request.mapping ? 1U : 2U, place_key(request.world),
                                   static_cast<std::uint64_t>(request.light)});
}

std::int64_t begin_ns(const DriveRequest& request) {
  const auto day = static_cast<std::int64_t>(world::key(drive_key(request), {kDay}) % 365U);
  std::int64_t hour = 10;
  switch (request.light) {
    case rendering::Light::kDay:
      break;
    case rendering::Light::kOvercast:
      hour = 14;
      break;
    case rendering::Light::kDusk:
      hour = 20;
      break;
    case rendering::Light::kNight:
      hour = 23;
      break;
  }
  return (kFirstDay_s + day * kDay_s + hour * 3600) * kSecond_ns;
}

void make_ideal(DriveSpec& spec) {
  spec.built = spec.nominal;
  spec.imu = ImuSpec::ideal();
  spec.wheels = WheelSpec::ideal();
  spec.wheels.slip = spec.request.slip;
  spec.bus = BusSpec::ideal();
  spec.camera_log.time_shift_s = 0.0;
  spec.camera_log.jitter_s = 0.0;
  spec.stated_time_shift_s = 0.0;
  spec.survey.poses.position_m = 0.0;
  spec.survey.poses.rotation_rad = 0.0;
  spec.survey.lidar.range_noise_m = 0.0;
  spec.survey.lidar.beam_divergence_rad = 0.0;
}

}  // namespace

std::uint64_t DriveSpec::key(Part part) const {
  return world::key(drive_key(request), {kPartBase + static_cast<std::uint64_t>(part)});
}

DriveSpec drive_spec(const DriveRequest& request) {
  DriveSpec spec;
  spec.request = request;
  spec.begin_ns = begin_ns(request);
  // Other drives stay within the stretch that was mapped.
  spec.ego.from_m = request.mapping ? 3.0 : 5.0;
  spec.ego.before_end_m = request.mapping ? 12.0 : 14.0;
  // One car drives through one world, whatever the day.
  const std::uint64_t car = world::key(place_key(request.world), {kCar});
  spec.nominal = nominal_mounting();
  spec.built = built_mounting(car);
  spec.imu.sensor = world::key(car, {3});
  spec.wheels.slip = request.slip;
  spec.camera.calibration = camera_calibration(request.image_width_px);
  spec.camera.rate_hz = request.camera_hz;
  spec.camera.readout_s = request.readout_s;
  spec.stated_time_shift_s = spec.camera_log.time_shift_s;
  world::Random shift(world::key(car, {4}));
  spec.camera_log.time_shift_s += 0.0003 * shift.normal();
  spec.prior = {.position_m = 0.3, .rotation_rad = 0.01745, .correlation_s = 10.0};
  spec.visit.seed = world::key(drive_key(request), {kVisit});
  world::Random visit(world::key(spec.visit.seed, {1}));
  spec.visit.parked_share = visit.uniform(0.35, 0.65);
  spec.visit.traffic_per_km = visit.uniform(8.0, 16.0);
  if (request.ideal_sensors) {
    make_ideal(spec);
  }
  spec.camera.T_cam_lamps = spec.built.T_vehicle_cam.inverse() *
                            RigidTransform{Eigen::Matrix3d::Identity(), kHeadLamps_m};
  return spec;
}

}  // namespace topoloc::simulation
