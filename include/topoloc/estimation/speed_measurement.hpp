// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/vector_update.hpp"

namespace topoloc::estimation {

/// How the IMU sits in the vehicle, and how far its wheels can be trusted.
struct SpeedModel {
  /// Rotation from IMU to vehicle axes (x forward, y left, z up).
  Eigen::Matrix3d R_vehicle_imu = Eigen::Matrix3d::Identity();
  double rotation_std_rad = 0.001;  ///< of that per axis; map building finds out by the way driven
  /// Point of the vehicle that moves straight ahead (rear-axle centre), in the IMU frame [m].
  Eigen::Vector3d wheel_reference_imu_m = Eigen::Vector3d::Zero();
  double wheel_scale = 1.0;             ///< true speed = wheel_scale * measured speed
  double std_forward_mps = 0.1;         ///< of the speed
  double std_forward_relative = 0.005;  ///< plus this share of the speed (tyre radius)
  double std_lateral_mps = 0.1;         ///< non-holonomic constraint, left (tyre slip)
  double std_vertical_mps = 0.1;        ///< non-holonomic constraint, up (suspension)
  /// These errors last about this long: samples that come faster are not independent.
  double correlation_s = 1.0;
  /// Sensors may read zero below this speed: a slower reading says only that.
  double dead_band_mps = 0.5;
  double chi2_gate = 25.0;  ///< 3 degrees of freedom
};

/// Vehicle-speed measurement with non-holonomic constraints (L7, errata of eq_z_v and eq_hv_0):
/// h = R_vi (R^T v + (w_m - b_g) x r) - [v_x 0 0]^T.
/// The rate w_m is the IMU's at the time of the speed sample; its white noise enters R.
VectorLinearisation<3> linearise_speed(const NominalState& x, const SpeedModel& model,
                                       const Eigen::Vector3d& angular_rate_radps,
                                       double gyro_std_radps, double speed_mps);

struct StandstillModel {
  double max_speed_mps = 1e-3;        ///< a wheel speed up to this is zero
  double min_duration_s = 0.5;        ///< wheels at zero and IMU quiet for this long
  double max_rate_span_radps = 0.05;  ///< largest minus smallest rate of any axis meanwhile
  double max_force_span_mps2 = 0.6;   ///< the same for the specific force
  double std_velocity_mps = 0.01;
  double std_rate_radps = 0.002;
  double chi2_gate = 30.0;  ///< 6 degrees of freedom
};

/// Zero-velocity and zero-rate measurement of a standing vehicle: h = [v; w_m - b_g].
/// A vehicle that creeps unnoticed does so for a while: of the velocity each sample tells only its
/// `independent_share`, as of a speed. The gyroscope's noise is white.
VectorLinearisation<6> linearise_standstill(const NominalState& x, const StandstillModel& model,
                                            const Eigen::Vector3d& angular_rate_radps,
                                            double independent_share);

}  // namespace topoloc::estimation
