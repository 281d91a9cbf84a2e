// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/estimation/state.hpp"

namespace topoloc::estimation {

/// IMU noise as continuous-time densities (Kalibr's units and names).
struct ImuNoise {
  double accel_noise_density = 2e-2;  ///< [m/s^2/sqrt(Hz)]
  double gyro_noise_density = 5e-4;   ///< [rad/s/sqrt(Hz)]
  double accel_random_walk = 1e-3;    ///< [m/s^3/sqrt(Hz)]
  double gyro_random_walk = 1e-5;     ///< [rad/s^2/sqrt(Hz)]
};

/// How a map wanders: it is made with poses that do not follow the true motion, so a vehicle moves
/// in it at another velocity than over the ground. They differ by a share of the speed, a
/// first-order Gauss-Markov process along the way. The filter's velocity is that in the map.
struct MapWander {
  /// Of the speed, per axis, one standard deviation. The default is that of maps made with KITTI's
  /// GNSS/INS (tools/oxts_noise.py); 0 for a map of the true motion.
  double share = 0.0075;
  double length_m = 16.0;  ///< after this way 1/e of a drift is left
};

/// `speed_mps`: magnitude. The noise with what the map's wander does to the velocity at this speed,
/// as white acceleration: sigma = share v changes within tau = length / v, so the density is sigma
/// sqrt(2 / tau).
ImuNoise with_wander(const ImuNoise& noise, const MapWander& wander, double speed_mps);

/// `rate_radps`: magnitude. The noise with what scale and axes of the gyro, wrong by a share
/// `gyro_scale_std` of the rate, do to the attitude in a turn, as white rate: turns last for some
/// seconds tau, so the density is sigma sqrt(2 tau). In a whole turn the error so is about that
/// share of the angle, and to all sides, as axes that are askew turn the vehicle to all sides.
ImuNoise with_scale_error(const ImuNoise& noise, double gyro_scale_std, double rate_radps);

/// Specific force and angular rate taken as constant over one propagation step, biases not removed.
struct InertialInput {
  Eigen::Vector3d specific_force_mps2;
  Eigen::Vector3d angular_rate_radps;
};

/// Nominal state after dt_s (L1, eq_imunominal with gravity: errata), the specific force turned
/// with the attitude of mid-step.
NominalState propagate_state(const NominalState& x, const InertialInput& u, double dt_s);

/// Discrete error-state transition F_x (eq_errors with the errata: gravity, carry-over of biases,
/// acceleration terms in the position row, J_r in the gyro-bias column; the mid-step attitude adds
/// second-order terms dv/db_g and dp/db_g).
Covariance transition_matrix(const NominalState& x, const InertialInput& u, double dt_s);

/// Discrete process noise F_n Q_n F_n^T of the continuous densities over dt_s.
Covariance process_noise(const ImuNoise& noise, double dt_s);

/// P <- F_x P F_x^T + F_n Q_n F_n^T (eq_pred2), using the block structure of F_x: a quarter of the
/// work of the dense product, same result to rounding.
void propagate_covariance(const NominalState& x, const InertialInput& u, const ImuNoise& noise,
                          double dt_s, Covariance& P);

}  // namespace topoloc::estimation
