// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_files.hpp"

#include "topoloc/geometry/so3.hpp"

#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/core.h>

namespace topoloc::simulation {
namespace {

void write_text(const std::filesystem::path& file, std::string_view text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot write");
  }
}

/// Without exponent, as people write it.
std::string decimal(double value) {
  std::string text = fmt::format("{:.8f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  return text.ends_with('.') ? text + "0" : text;
}

std::string list(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", decimal(v.x()), decimal(v.y()), decimal(v.z()));
}

std::string camchain(const DriveSpec& spec) {
  const CameraCalibration& lens = spec.camera.calibration;
  const PinholeCamera& pinhole = lens.pinhole;
  // Camera and IMU are calibrated with each other: how the IMU sits in the car has no part in it.
  const RigidTransform T_cam_imu = spec.nominal.T_vehicle_cam.inverse() * spec.built.T_vehicle_imu;
  std::string rows;
  for (int row = 0; row < 3; ++row) {
    rows += fmt::format("  - [{:.15f}, {:.15f}, {:.15f}, {:.15f}]\n", T_cam_imu.R(row, 0),
                        T_cam_imu.R(row, 1), T_cam_imu.R(row, 2), T_cam_imu.p[row]);
  }
  return fmt::format(
      "cam0:\n"
      "  camera_model: pinhole\n"
      "  intrinsics: [{}, {}, {}, {}]\n"
      "  distortion_model: radtan\n"
      "  distortion_coeffs: [{}, {}, {}, {}]\n"
      "  resolution: [{}, {}]\n"
      "  T_cam_imu:\n{}  - [0.0, 0.0, 0.0, 1.0]\n"
      "  timeshift_cam_imu: {}\n",
      decimal(pinhole.fx_px), decimal(pinhole.fy_px), decimal(pinhole.cx_px),
      decimal(pinhole.cy_px), decimal(lens.coefficients[0]), decimal(lens.coefficients[1]),
      decimal(lens.coefficients[2]), decimal(lens.coefficients[3]), pinhole.width_px,
      pinhole.height_px, rows, decimal(spec.stated_time_shift_s));
}

std::string imu(const DriveSpec& spec) {
  const estimation::ImuNoise noise = ImuSpec{}.noise;
  return fmt::format(
      "# Of the simulated sensor: a MEMS part for cars. Vibration of engine and road comes on "
      "top.\n"
      "accelerometer_noise_density: {}  # m/s^2/sqrt(Hz)\n"
      "accelerometer_random_walk: {}  # m/s^3/sqrt(Hz)\n"
      "gyroscope_noise_density: {}  # rad/s/sqrt(Hz)\n"
      "gyroscope_random_walk: {}  # rad/s^2/sqrt(Hz)\n"
      "update_rate: {:.1f}\n",
      decimal(noise.accel_noise_density), decimal(noise.accel_random_walk),
      decimal(noise.gyro_noise_density), decimal(noise.gyro_random_walk), spec.imu.rate_hz);
}

std::string vehicle(const DriveSpec& spec) {
  const RigidTransform& T_vehicle_imu = spec.nominal.T_vehicle_imu;
  const ImuSpec sensor;
  return fmt::format(
      R"(# Every key: docs/vehicle-config.md
format: 1
name: simulated {} {}
can:
  dbc: topoloc_imu_wheel.dbc
  imu:
    acceleration: [IMU_ACCEL.ACCEL_X, IMU_ACCEL.ACCEL_Y, IMU_ACCEL.ACCEL_Z]
    angular_rate: [IMU_RATE.RATE_X, IMU_RATE.RATE_Y, IMU_RATE.RATE_Z]
    counters: [IMU_ACCEL.ACCEL_COUNTER, IMU_RATE.RATE_COUNTER]
  wheels:
    speeds: [WHEEL_SPEEDS.FRONT_LEFT, WHEEL_SPEEDS.FRONT_RIGHT,
             WHEEL_SPEEDS.REAR_LEFT, WHEEL_SPEEDS.REAR_RIGHT]
  direction:
    signal: TRAVEL_DIRECTION.DIRECTION
    reverse_values: [REVERSE]
camera:
  calibration: camchain.yaml
  name: cam0
  channel: CAMERA
imu:
  calibration: imu.yaml
  # Turn-on biases of this kind of sensor.
  gyro_bias_std_radps: {}
  accel_bias_std_mps2: {}
  gyro_scale_std: {}
vehicle:
  # By the car's drawings: the IMU as it is mounted is turned by about 0.1 degrees against them.
  rotation_vehicle_imu_rpy_rad: {}
  rotation_std_rad: 0.002
  wheel_reference_imu_m: {}
  # Tyres: known to 0.5 %.
  wheel_scale: 1.0
)",
      world::name(spec.request.world.scenario), rendering::name(spec.request.light),
      decimal(sensor.gyro_bias_radps), decimal(sensor.accel_bias_mps2), decimal(sensor.scale_error),
      list(so3::roll_pitch_yaw(T_vehicle_imu.R)), list(T_vehicle_imu.inverse().p));
}

}  // namespace

void write_vehicle_files(const std::filesystem::path& folder, const DriveSpec& spec) {
  write_text(folder / "topoloc_imu_wheel.dbc", dbc_text());
  write_text(folder / "camchain.yaml", camchain(spec));
  write_text(folder / "imu.yaml", imu(spec));
  write_text(folder / "vehicle.yaml", vehicle(spec));
}

}  // namespace topoloc::simulation
