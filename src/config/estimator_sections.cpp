// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "config/sections.hpp"

namespace topoloc::config {
namespace {

void read_history(StrictNode& estimator, estimation::HistoryConfig& config) {
  StrictNode history = estimator.section("history");
  history.read("duration_s", config.duration_s, positive_up_to(60.0));
  history.read("capacity", config.capacity, {16, 1 << 20});
  history.read("map_capacity", config.map_capacity, {1, 1024});
  history.read("pending_capacity", config.pending_capacity, {1, 4096});
  history.finish();
}

void read_initial(StrictNode& estimator, estimation::InitialUncertainty& config) {
  StrictNode initial = estimator.section("initial");
  initial.read("position_m", config.position_m, positive_up_to(100.0));
  initial.read("attitude_rad", config.attitude_rad, positive_up_to(1.0));
  initial.read("velocity_mps", config.velocity_mps, positive_up_to(100.0));
  initial.read("velocity_unknown_mps", config.velocity_unknown_mps, positive_up_to(100.0));
  initial.read("gravity_mps2", config.gravity_mps2, {0.0, 1.0});
  initial.finish();
}

void read_imu_gap(StrictNode& estimator, estimation::ImuGapModel& model) {
  StrictNode gap = estimator.section("imu_gap");
  gap.read("longer_than_s", model.longer_than_s, positive_up_to(10.0));
  gap.read("accel_mps2", model.accel_mps2, {0.0, 100.0});
  gap.read("rate_radps", model.rate_radps, {0.0, 10.0});
  gap.finish();
}

void read_map_wander(StrictNode& estimator, estimation::MapWander& model) {
  StrictNode wander = estimator.section("map_wander");
  wander.read("share", model.share, {0.0, 1.0});
  wander.read("length_m", model.length_m, positive_up_to(1e4));
  wander.finish();
}

void read_health(StrictNode& estimator, estimation::HealthConfig& config) {
  StrictNode health = estimator.section("health");
  health.read("fix_timeout_s", config.fix_timeout_s, positive_up_to(3600.0));
  health.read("lost_position_std_m", config.lost_position_std_m, positive_up_to(1000.0));
  health.read("imu_timeout_s", config.imu_timeout_s, positive_up_to(10.0));
  health.read("max_imu_gap_s", config.max_imu_gap_s, positive_up_to(60.0));
  health.read("speed_timeout_s", config.speed_timeout_s, positive_up_to(60.0));
  health.read("max_pose_age_s", config.max_pose_age_s, positive_up_to(60.0));
  health.read("rejections_before_doubt", config.rejections_before_doubt, {1, 1000});
  health.read("doubt_position_m", config.doubt_position_m, {0.0, 100.0});
  health.read("doubt_attitude_rad", config.doubt_attitude_rad, {0.0, 1.0});
  health.read("speed_doubt_after_s", config.speed_doubt_after_s, positive_up_to(3600.0));
  health.read("damaged_imu_attitude_rad", config.damaged_imu_attitude_rad, {0.0, 1.0});
  health.read("damaged_imu_velocity_mps", config.damaged_imu_velocity_mps, {0.0, 100.0});
  health.read("doubt_velocity_mps", config.doubt_velocity_mps, {0.0, 100.0});
  health.finish();
}

void read_map_update(StrictNode& estimator, estimation::MapUpdateConfig& config) {
  StrictNode update = estimator.section("map_update");
  update.read("max_iterations", config.max_iterations, {1, 100});
  update.read("convergence_theta_rad", config.convergence_theta_rad, positive_up_to(0.1));
  update.read("convergence_p_m", config.convergence_p_m, positive_up_to(1.0));
  update.read("match_gate_chi2", config.match_gate_chi2, positive_up_to(1e6));
  std::string kernel = "cauchy";
  update.read("kernel", kernel, {"none", "huber", "cauchy"});
  config.kernel = kernel == "none"    ? estimation::RobustKernel::kNone
                  : kernel == "huber" ? estimation::RobustKernel::kHuber
                                      : estimation::RobustKernel::kCauchy;
  update.read("kernel_width_sigma", config.kernel_width_sigma, positive_up_to(100.0));
  update.read("min_matches", config.min_matches, {3, estimation::kMaxMatches});
  update.read("min_gate_share", config.min_gate_share, {0.0, 1.0});
  update.read("pose_gate_chi2", config.pose_gate_chi2, positive_up_to(1e6));
  update.finish();
}

}  // namespace

void read_speed(StrictNode& top, estimation::EstimatorConfig& config) {
  StrictNode speed = top.section("speed");
  estimation::SpeedModel& model = config.models.speed;
  speed.read("use", config.use_speed);
  speed.read("std_forward_mps", model.std_forward_mps, positive_up_to(10.0));
  speed.read("std_forward_relative", model.std_forward_relative, {0.0, 1.0});
  speed.read("std_lateral_mps", model.std_lateral_mps, positive_up_to(10.0));
  speed.read("std_vertical_mps", model.std_vertical_mps, positive_up_to(10.0));
  speed.read("correlation_s", model.correlation_s, positive_up_to(60.0));
  speed.read("dead_band_mps", model.dead_band_mps, {0.0, 5.0});
  speed.read("chi2_gate", model.chi2_gate, positive_up_to(1e6));
  speed.finish();
}

void read_standstill(StrictNode& top, estimation::StandstillModel& model) {
  StrictNode standstill = top.section("standstill");
  standstill.read("max_speed_mps", model.max_speed_mps, {0.0, 1.0});
  standstill.read("min_duration_s", model.min_duration_s, positive_up_to(60.0));
  standstill.read("max_rate_span_radps", model.max_rate_span_radps, positive_up_to(10.0));
  standstill.read("max_force_span_mps2", model.max_force_span_mps2, positive_up_to(100.0));
  standstill.read("std_velocity_mps", model.std_velocity_mps, positive_up_to(1.0));
  standstill.read("std_rate_radps", model.std_rate_radps, positive_up_to(1.0));
  standstill.read("chi2_gate", model.chi2_gate, positive_up_to(1e6));
  standstill.finish();
}

void read_estimator(StrictNode& top, estimation::EstimatorConfig& config) {
  StrictNode estimator = top.section("estimator");
  estimator.read("gravity_mps2", config.gravity_mps2, {9.7, 9.9});
  read_history(estimator, config.history);
  read_initial(estimator, config.initial);
  read_imu_gap(estimator, config.models.imu_gap);
  read_map_wander(estimator, config.models.map_wander);
  read_health(estimator, config.health);
  read_map_update(estimator, config.models.map_update);
  estimator.finish();
}

}  // namespace topoloc::config
