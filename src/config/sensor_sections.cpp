// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/so3.hpp"

#include "config/sections.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

namespace topoloc::config {
namespace {

void read_seconds(StrictNode& node, const char* key, std::int64_t& target_ns, Range range_s) {
  double seconds = static_cast<double>(target_ns) * 1e-9;
  node.read(key, seconds, range_s);
  target_ns = std::llround(seconds * 1e9);
}

void read_vector(StrictNode& node, const char* key, Eigen::Vector3d& target, Range range) {
  std::vector<double> values(target.data(), target.data() + 3);
  node.read(key, values, 3, 3, range);
  std::copy(values.begin(), values.end(), target.data());
}

/// x, y, z: all three signals, or none where the key is absent.
void read_axes(StrictNode& node, const char* key, std::array<std::string, 3>& target) {
  std::vector<std::string> names;
  node.read(key, names);
  if (names.empty()) {
    return;
  }
  if (names.size() != target.size()) {
    throw node.error(key,
                     "expected three signals (x, y, z), found " + std::to_string(names.size()));
  }
  std::copy(names.begin(), names.end(), target.begin());
}

std::filesystem::path existing_file(const StrictNode& node, const char* key,
                                    const std::string& name) {
  std::filesystem::path file = node.resolve(name);
  if (!std::filesystem::is_regular_file(file)) {
    throw node.error(key, "no such file: " + file.string());
  }
  return file;
}

/// 0 to 65535, also as 0x1A2B.
std::optional<std::uint16_t> read_data_id(StrictNode& node) {
  std::string text;
  node.read("data_id", text);
  if (text.empty()) {
    return std::nullopt;
  }
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  const char* const first = text.data() + (hexadecimal ? 2 : 0);
  const char* const last = text.data() + text.size();
  std::uint16_t value = 0;
  const auto [end, failure] = std::from_chars(first, last, value, hexadecimal ? 16 : 10);
  if (failure != std::errc{} || end != last) {
    throw node.error("data_id", "expected a number from 0 to 65535, found '" + text + "'");
  }
  return value;
}

can::MessageCheckConfig read_check(StrictNode& node) {
  can::MessageCheckConfig check;
  node.require("message", check.message);
  check.place = node.place("message");
  node.read("interface", check.interface);
  node.read("counter", check.counter);
  if (node.has("counter_max")) {
    int most = 0;
    node.read("counter_max", most, Range{1, 2e9});
    check.counter_max = static_cast<std::uint64_t>(most);
  }
  node.read("checksum", check.checksum);
  if (check.counter.empty() && check.checksum.empty()) {
    throw node.error("message", "expected a counter or a checksum with it");
  }
  if (!check.checksum.empty()) {
    const auto& names = can::kChecksumNames;
    std::string algorithm;
    node.require("algorithm", algorithm, std::vector<std::string>(names.begin(), names.end()));
    check.algorithm = static_cast<can::Checksum>(std::find(names.begin(), names.end(), algorithm) -
                                                 names.begin());
    check.data_id = read_data_id(node);
  }
  node.finish();
  return check;
}

void require_file(StrictNode& node, const char* key, std::filesystem::path& target) {
  std::string name;
  node.require(key, name);
  target = existing_file(node, key, name);
}

}  // namespace

void read_can(StrictNode& top, can::VehicleSignalsConfig& config) {
  StrictNode can = top.required_section("can");
  std::vector<std::string> dbcs;
  can.require_one_or_more("dbc", dbcs);
  for (const std::string& name : dbcs) {
    config.dbcs.push_back(existing_file(can, "dbc", name));
  }
  can.read("check_limits", config.check_limits);

  StrictNode imu = can.section("imu");
  read_axes(imu, "acceleration", config.imu.acceleration);
  read_axes(imu, "angular_rate", config.imu.angular_rate);
  if (config.imu.acceleration[0].empty() != config.imu.angular_rate[0].empty()) {
    throw can.error("imu", "needs both acceleration and angular_rate");
  }
  imu.read("acceleration_unit", config.imu.acceleration_unit);
  imu.read("angular_rate_unit", config.imu.angular_rate_unit);
  imu.read("counters", config.imu.counters);
  read_seconds(imu, "pairing_tolerance_s", config.imu.pairing_tolerance_ns, {0.0, 1.0});
  std::string time_source = "angular_rate";
  imu.read("time_source", time_source, {"angular_rate", "acceleration"});
  config.imu.time_source = time_source == "angular_rate" ? can::ImuTimeSource::kAngularRate
                                                         : can::ImuTimeSource::kAcceleration;
  imu.read("interface", config.imu.interface);
  imu.finish();

  StrictNode wheels = can.section("wheels");
  wheels.read("speeds", config.wheels.speeds);
  if (config.wheels.speeds.size() > can::kMaxWheels) {
    throw wheels.error("speeds", "expected at most " + std::to_string(can::kMaxWheels) +
                                     " signals, found " +
                                     std::to_string(config.wheels.speeds.size()));
  }
  wheels.read("unit", config.wheels.unit);
  read_seconds(wheels, "pairing_tolerance_s", config.wheels.pairing_tolerance_ns, {0.0, 1.0});
  wheels.read("interface", config.wheels.interface);
  wheels.finish();

  StrictNode direction = can.section("direction");
  direction.read("signal", config.direction.signal);
  direction.read("reverse_values", config.direction.reverse_values);
  config.direction.reverse_values_place = direction.place("reverse_values");
  if (config.direction.signal.empty() != config.direction.reverse_values.empty()) {
    throw can.error("direction", "needs both signal and reverse_values");
  }
  direction.read("interface", config.direction.interface);
  direction.finish();

  for (StrictNode& check : can.items("checks")) {
    config.checks.push_back(read_check(check));
  }
  can.finish();
}

void read_camera(StrictNode& top, CameraConfig& config, std::vector<std::filesystem::path>& files) {
  if (!top.has("camera")) {
    return;
  }
  StrictNode camera = top.section("camera");
  std::filesystem::path calibration;
  require_file(camera, "calibration", calibration);
  std::string name = "cam0";
  camera.read("name", name);
  camera.read("channel", config.channel);
  if (camera.has("mask")) {
    require_file(camera, "mask", config.mask);
    files.push_back(config.mask);
  }
  camera.finish();
  files.push_back(calibration);
  config.kalibr = load_kalibr_camera(calibration, name);
}

void read_imu(StrictNode& top, estimation::EstimatorConfig& config,
              std::vector<std::filesystem::path>& files) {
  StrictNode imu = top.required_section("imu");
  std::filesystem::path calibration;
  require_file(imu, "calibration", calibration);
  files.push_back(calibration);
  read_vector(imu, "gyro_bias_radps", config.initial_gyro_bias_radps, {-1.0, 1.0});
  read_vector(imu, "accel_bias_mps2", config.initial_accel_bias_mps2, {-10.0, 10.0});
  imu.read("gyro_bias_std_radps", config.initial.gyro_bias_radps, positive_up_to(1.0));
  imu.read("gyro_scale_std", config.models.gyro_scale_std, {0.0, 0.1});
  imu.read("accel_bias_std_mps2", config.initial.accel_bias_mps2, positive_up_to(10.0));
  imu.read("max_force_mps2", config.imu_screen.max_force_mps2, positive_up_to(1e4));
  imu.read("max_rate_radps", config.imu_screen.max_rate_radps, positive_up_to(1e3));
  imu.read("max_force_jump_mps2", config.imu_screen.max_force_jump_mps2, positive_up_to(1e4));
  imu.read("max_rate_jump_radps", config.imu_screen.max_rate_jump_radps, positive_up_to(1e3));
  imu.finish();
  const KalibrImu kalibr = load_kalibr_imu(calibration);
  config.models.imu = kalibr.noise;
  config.models.imu_rate_hz = kalibr.update_rate_hz;
}

void read_mounting(StrictNode& top, estimation::SpeedModel& model) {
  StrictNode vehicle = top.section("vehicle");
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
  read_vector(vehicle, "rotation_vehicle_imu_rpy_rad", rpy_rad,
              {-std::numbers::pi, std::numbers::pi});
  vehicle.read("rotation_std_rad", model.rotation_std_rad, positive_up_to(1.0));
  read_vector(vehicle, "wheel_reference_imu_m", model.wheel_reference_imu_m, {-20.0, 20.0});
  vehicle.read("wheel_scale", model.wheel_scale, {0.5, 2.0});
  vehicle.finish();
  model.R_vehicle_imu = so3::from_roll_pitch_yaw(rpy_rad);
}

}  // namespace topoloc::config
