// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/state.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::estimation {

using namespace error_index;

NominalState boxplus(const NominalState& x, const ErrorVector& dx) {
  NominalState y = x;
  y.R_world_imu = so3::renormalised(x.R_world_imu * so3::exp(dx.segment<3>(kTheta)));
  y.p_world_imu += dx.segment<3>(kP);
  y.v_world_imu += dx.segment<3>(kV);
  y.accel_bias_mps2 += dx.segment<3>(kBa);
  y.gyro_bias_radps += dx.segment<3>(kBg);
  y.gravity_mps2 += dx.segment<3>(kG);
  return y;
}

ErrorVector boxminus(const NominalState& x, const NominalState& y) {
  ErrorVector dx;
  dx.segment<3>(kTheta) = so3::log(y.R_world_imu.transpose() * x.R_world_imu);
  dx.segment<3>(kP) = x.p_world_imu - y.p_world_imu;
  dx.segment<3>(kV) = x.v_world_imu - y.v_world_imu;
  dx.segment<3>(kBa) = x.accel_bias_mps2 - y.accel_bias_mps2;
  dx.segment<3>(kBg) = x.gyro_bias_radps - y.gyro_bias_radps;
  dx.segment<3>(kG) = x.gravity_mps2 - y.gravity_mps2;
  return dx;
}

bool all_finite(const NominalState& x) {
  return x.R_world_imu.allFinite() && x.p_world_imu.allFinite() && x.v_world_imu.allFinite() &&
         x.accel_bias_mps2.allFinite() && x.gyro_bias_radps.allFinite() &&
         x.gravity_mps2.allFinite();
}

}  // namespace topoloc::estimation
