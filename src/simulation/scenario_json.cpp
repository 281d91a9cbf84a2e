// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "simulation/scenario_json.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/simulation/world_file.hpp"

#include <nlohmann/json.hpp>

namespace topoloc::simulation {
namespace {

using nlohmann::ordered_json;

ordered_json axes_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json to_json(const RigidTransform& T) {
  return {{"translation_m", axes_of(T.p)}, {"rpy_rad", axes_of(so3::roll_pitch_yaw(T.R))}};
}

ordered_json to_json(const PoseError::Spec& spec) {
  return {{"position_m", spec.position_m},
          {"rotation_rad", spec.rotation_rad},
          {"correlation_s", spec.correlation_s}};
}

ordered_json to_json(const ImuSpec& imu) {
  return {{"rate_hz", imu.rate_hz},
          {"accel_noise_density", imu.noise.accel_noise_density},
          {"accel_random_walk", imu.noise.accel_random_walk},
          {"gyro_noise_density", imu.noise.gyro_noise_density},
          {"gyro_random_walk", imu.noise.gyro_random_walk},
          {"accel_bias_mps2", imu.accel_bias_mps2},
          {"gyro_bias_radps", imu.gyro_bias_radps},
          {"scale_error", imu.scale_error},
          {"misalignment_rad", imu.misalignment_rad},
          {"engine_mps2", imu.engine_mps2},
          {"road_mps2_per_mps", imu.road_mps2_per_mps},
          {"road_radps_per_mps", imu.road_radps_per_mps}};
}

ordered_json to_json(const WheelSpec& wheels) {
  return {{"rate_hz", wheels.rate_hz},
          {"radius_error", wheels.radius_error},
          {"single_radius_error", wheels.single_radius_error},
          {"noise_mps", wheels.noise_mps},
          {"dead_band_mps", wheels.dead_band_mps},
          {"slip", wheels.slip}};
}

ordered_json to_json(const GnssSpec& gnss) {
  return {{"rate_hz", gnss.rate_hz},
          {"horizontal_m", gnss.horizontal_m},
          {"vertical_m", gnss.vertical_m},
          {"correlation_s", gnss.correlation_s},
          {"white_m", gnss.white_m},
          {"jump_m", gnss.jump_m},
          {"jumps_per_min", gnss.jumps_per_min}};
}

ordered_json camera(const DriveSpec& spec) {
  const rendering::CameraSpec& camera = spec.camera;
  return {{"width_px", camera.calibration.pinhole.width_px},
          {"height_px", camera.calibration.pinhole.height_px},
          {"rate_hz", camera.rate_hz},
          {"max_exposure_s", camera.max_exposure_s},
          {"readout_s", camera.readout_s},
          {"read_noise_electrons", camera.read_noise_electrons},
          {"jpeg_quality", spec.camera_log.jpeg_quality},
          {"time_shift_s", spec.camera_log.time_shift_s},
          {"stated_time_shift_s", spec.stated_time_shift_s},
          {"jitter_s", spec.camera_log.jitter_s}};
}

ordered_json survey(const SurveySpec& survey) {
  return {{"beams", survey.lidar.beams},
          {"columns", survey.lidar.columns},
          {"range_noise_m", survey.lidar.range_noise_m},
          {"max_range_m", survey.lidar.max_range_m},
          {"rate_hz", survey.lidar.rate_hz},
          {"beam_divergence_rad", survey.lidar.beam_divergence_rad},
          {"spacing_m", survey.spacing_m},
          {"near_m", survey.near_m},
          {"near_edge_m", survey.near_edge_m},
          {"middle_m", survey.middle_m},
          {"middle_edge_m", survey.middle_edge_m},
          {"far_edge_m", survey.far_edge_m},
          {"poses", to_json(survey.poses)}};
}

}  // namespace

std::string scenario_json(const DriveSpec& spec, const DriveSummary& summary) {
  const DriveRequest& request = spec.request;
  ordered_json json = {
      {"world",
       {{"scenario", world::name(request.world.scenario)},
        {"seed", request.world.seed},
        {"length_m", request.world.length_m},
        {"version", kWorldVersion}}},
      {"drive",
       {{"seed", request.seed},
        {"mapping", request.mapping},
        {"light", rendering::name(request.light)},
        {"ideal_sensors", request.ideal_sensors},
        {"begin_ns", spec.begin_ns},
        {"duration_s", summary.duration_s},
        {"way_m", summary.way_m},
        {"reversed_m", summary.reversed_m},
        {"standing_s", summary.standing_s},
        {"parked_share", spec.visit.parked_share},
        {"traffic_per_km", spec.visit.traffic_per_km}}},
      {"mounting",
       {{"T_vehicle_imu", to_json(spec.built.T_vehicle_imu)},
        {"T_vehicle_cam", to_json(spec.built.T_vehicle_cam)},
        {"T_vehicle_lidar", to_json(spec.built.T_vehicle_lidar)}}},
      {"imu", to_json(spec.imu)},
      {"wheels", to_json(spec.wheels)},
      {"bus", {{"jitter_s", spec.bus.jitter_s}, {"max_delay_s", spec.bus.max_delay_s}}},
      {"gnss", to_json(spec.gnss)},
      {"camera", camera(spec)}};
  if (request.mapping && request.cloud) {
    json["survey"] = survey(spec.survey);
  }
  if (request.mapping) {
    json["prior"] = to_json(spec.prior);
  }
  return json.dump(2) + "\n";
}

}  // namespace topoloc::simulation
