// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/estimation/propagation.hpp"
#include "topoloc/simulation/trajectory.hpp"

#include <cstdint>
#include <vector>

namespace topoloc::simulation {

/// A low-cost MEMS IMU after a coarse calibration. Densities: those of the Bosch BMI088's data
/// sheet (BST-BMI088-DS001); walks: the Allan variance that users of Kalibr published for a BMI055;
/// biases, scale and axes: about half of what the data sheets of such parts allow, as a coarse
/// calibration at the works leaves them. Zero everywhere: an ideal one.
struct ImuSpec {
  double rate_hz = 100.0;
  estimation::ImuNoise noise{.accel_noise_density = 0.0017,
                             .gyro_noise_density = 0.00025,
                             .accel_random_walk = 0.0004,
                             .gyro_random_walk = 0.000011};
  double accel_bias_mps2 = 0.1;      ///< turn-on, one standard deviation per axis
  double gyro_bias_radps = 0.005;    ///< the same
  double scale_error = 0.005;        ///< per axis, one standard deviation
  double misalignment_rad = 0.003;   ///< between the axes, the same
  double engine_mps2 = 0.03;         ///< amplitude of its shaking at idle speed
  double road_mps2_per_mps = 0.015;  ///< r.m.s. of the road's, for each m/s driven
  double road_radps_per_mps = 0.0003;
  std::uint64_t sensor = 0;  ///< which of its kind: scale and axes stay with it from drive to drive

  static ImuSpec ideal();
};

/// Specific force and angular rate at a moment: what an ideal IMU in this place says.
estimation::ImuSample true_imu_sample(const BodyMotion& imu);

/// Samples at multiples of the period from 0 on; `time_ns` is drive time. Each holds the values of
/// its moment, so that the mean of two neighbours is that of the time between them, as the
/// estimator takes it. `T_vehicle_imu`: as built; `key`: of the drive.
std::vector<estimation::ImuSample> sense_motion(const Trajectory& vehicle,
                                                const RigidTransform& T_vehicle_imu,
                                                const ImuSpec& spec, std::uint64_t key);

}  // namespace topoloc::simulation
