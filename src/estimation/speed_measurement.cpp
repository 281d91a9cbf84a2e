// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/speed_measurement.hpp"

#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::estimation {

using namespace error_index;

VectorLinearisation<3> linearise_speed(const NominalState& x, const SpeedModel& model,
                                       const Eigen::Vector3d& angular_rate_radps,
                                       double gyro_std_radps, double speed_mps) {
  const Eigen::Matrix3d& R_vi = model.R_vehicle_imu;
  const Eigen::Vector3d v_imu = x.R_world_imu.transpose() * x.v_world_imu;
  const Eigen::Vector3d rate = angular_rate_radps - x.gyro_bias_radps;
  const double v_x = model.wheel_scale * speed_mps;

  VectorLinearisation<3> m;
  m.z = R_vi * (v_imu + rate.cross(model.wheel_reference_imu_m)) - Eigen::Vector3d(v_x, 0.0, 0.0);
  const Eigen::Matrix3d lever = R_vi * so3::skew(model.wheel_reference_imu_m);
  m.H.setZero();
  m.H.block<3, 3>(0, kTheta) = R_vi * so3::skew(v_imu);
  m.H.block<3, 3>(0, kV) = R_vi * x.R_world_imu.transpose();
  m.H.block<3, 3>(0, kBg) = lever;

  double forward_var =
      std::pow(model.std_forward_mps, 2.0) + std::pow(model.std_forward_relative * v_x, 2.0);
  if (std::abs(v_x) < model.dead_band_mps) {
    // Sensors go blind here: the reading says only that the vehicle is slower than the dead band.
    forward_var = std::max(forward_var, model.dead_band_mps * model.dead_band_mps);
  }
  m.R = Eigen::Vector3d(forward_var, std::pow(model.std_lateral_mps, 2.0),
                        std::pow(model.std_vertical_mps, 2.0))
            .asDiagonal();
  m.R += gyro_std_radps * gyro_std_radps * lever * lever.transpose();
  return m;
}

VectorLinearisation<6> linearise_standstill(const NominalState& x, const StandstillModel& model,
                                            const Eigen::Vector3d& angular_rate_radps,
                                            double independent_share) {
  VectorLinearisation<6> m;
  m.z << x.v_world_imu, angular_rate_radps - x.gyro_bias_radps;
  m.H.setZero();
  m.H.block<3, 3>(0, kV).setIdentity();
  m.H.block<3, 3>(3, kBg) = -Eigen::Matrix3d::Identity();
  m.R.setZero();
  m.R.diagonal().head<3>().setConstant(model.std_velocity_mps * model.std_velocity_mps /
                                       independent_share);
  m.R.diagonal().tail<3>().setConstant(model.std_rate_radps * model.std_rate_radps);
  return m;
}

}  // namespace topoloc::estimation
