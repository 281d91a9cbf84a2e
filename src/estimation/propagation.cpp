// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/propagation.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>

namespace topoloc::estimation {

using namespace error_index;

namespace {

/// The blocks of F_x that are neither zero nor identity.
struct TransitionBlocks {
  Eigen::Matrix3d theta_theta;
  Eigen::Matrix3d theta_bg;
  Eigen::Matrix3d p_theta;
  Eigen::Matrix3d p_ba;
  Eigen::Matrix3d p_bg;
  Eigen::Matrix3d v_theta;
  Eigen::Matrix3d v_ba;
  Eigen::Matrix3d v_bg;
  double dt_s;
  double half_dt_sq;
};

TransitionBlocks transition_blocks(const NominalState& x, const InertialInput& u, double dt_s) {
  const Eigen::Vector3d accel = u.specific_force_mps2 - x.accel_bias_mps2;
  const Eigen::Vector3d half_phi = 0.5 * dt_s * (u.angular_rate_radps - x.gyro_bias_radps);
  const Eigen::Matrix3d half_turn = so3::exp(half_phi);
  const Eigen::Matrix3d R_mid = x.R_world_imu * half_turn;
  const Eigen::Matrix3d accel_by_theta = -x.R_world_imu * so3::skew(half_turn * accel);
  const Eigen::Matrix3d accel_by_bg =
      0.5 * dt_s * R_mid * so3::skew(accel) * so3::right_jacobian(half_phi);
  const double half_dt_sq = 0.5 * dt_s * dt_s;
  return {.theta_theta = (half_turn * half_turn).transpose(),
          .theta_bg = -so3::right_jacobian(2.0 * half_phi) * dt_s,
          .p_theta = accel_by_theta * half_dt_sq,
          .p_ba = -R_mid * half_dt_sq,
          .p_bg = accel_by_bg * half_dt_sq,
          .v_theta = accel_by_theta * dt_s,
          .v_ba = -R_mid * dt_s,
          .v_bg = accel_by_bg * dt_s,
          .dt_s = dt_s,
          .half_dt_sq = half_dt_sq};
}

/// M <- M F_x^T for an 18-column matrix: only the columns of theta, p and v change. By columns,
/// since these lie in one piece.
void multiply_right(const TransitionBlocks& F, Covariance& M) {
  using Columns = Eigen::Matrix<double, kErrorDim, 3>;
  const Columns theta = M.middleCols<3>(kTheta);
  const auto v = M.middleCols<3>(kV);
  const auto ba = M.middleCols<3>(kBa);
  const auto bg = M.middleCols<3>(kBg);
  const auto g = M.middleCols<3>(kG);
  M.middleCols<3>(kP) += F.dt_s * v + F.half_dt_sq * g + theta.lazyProduct(F.p_theta.transpose()) +
                         ba.lazyProduct(F.p_ba.transpose()) + bg.lazyProduct(F.p_bg.transpose());
  M.middleCols<3>(kV) += F.dt_s * g + theta.lazyProduct(F.v_theta.transpose()) +
                         ba.lazyProduct(F.v_ba.transpose()) + bg.lazyProduct(F.v_bg.transpose());
  M.middleCols<3>(kTheta) =
      theta.lazyProduct(F.theta_theta.transpose()) + bg.lazyProduct(F.theta_bg.transpose());
}

void add_process_noise(const ImuNoise& noise, double dt_s, Covariance& P) {
  // White acceleration noise integrated once into v and twice into p.
  const double accel_var = noise.accel_noise_density * noise.accel_noise_density;
  const double gyro_var = noise.gyro_noise_density * noise.gyro_noise_density;
  const double accel_walk_var = noise.accel_random_walk * noise.accel_random_walk;
  const double gyro_walk_var = noise.gyro_random_walk * noise.gyro_random_walk;
  const double p_v = accel_var * dt_s * dt_s / 2.0;
  for (int i = 0; i < 3; ++i) {
    P(kTheta + i, kTheta + i) += gyro_var * dt_s;
    P(kP + i, kP + i) += accel_var * dt_s * dt_s * dt_s / 3.0;
    P(kP + i, kV + i) += p_v;
    P(kV + i, kP + i) += p_v;
    P(kV + i, kV + i) += accel_var * dt_s;
    P(kBa + i, kBa + i) += accel_walk_var * dt_s;
    P(kBg + i, kBg + i) += gyro_walk_var * dt_s;
  }
}

}  // namespace

ImuNoise with_wander(const ImuNoise& noise, const MapWander& wander, double speed_mps) {
  ImuNoise sum = noise;
  const double density = wander.share * speed_mps * std::sqrt(2.0 * speed_mps / wander.length_m);
  sum.accel_noise_density = std::hypot(noise.accel_noise_density, density);
  return sum;
}

ImuNoise with_scale_error(const ImuNoise& noise, double gyro_scale_std, double rate_radps) {
  constexpr double kTurn_s = 2.5;
  ImuNoise sum = noise;
  const double density = gyro_scale_std * rate_radps * std::sqrt(2.0 * kTurn_s);
  sum.gyro_noise_density = std::hypot(noise.gyro_noise_density, density);
  return sum;
}

NominalState propagate_state(const NominalState& x, const InertialInput& u, double dt_s) {
  NominalState y = x;
  // The attitude of mid-step turns the specific force: second order in dt at no extra sample.
  const Eigen::Matrix3d half_turn =
      so3::exp(0.5 * dt_s * (u.angular_rate_radps - x.gyro_bias_radps));
  const Eigen::Matrix3d R_mid = x.R_world_imu * half_turn;
  const Eigen::Vector3d accel_world =
      R_mid * (u.specific_force_mps2 - x.accel_bias_mps2) + x.gravity_mps2;
  y.R_world_imu = so3::renormalised(R_mid * half_turn);
  y.p_world_imu += x.v_world_imu * dt_s + 0.5 * accel_world * dt_s * dt_s;
  y.v_world_imu += accel_world * dt_s;
  return y;
}

Covariance transition_matrix(const NominalState& x, const InertialInput& u, double dt_s) {
  Covariance F = Covariance::Identity();
  multiply_right(transition_blocks(x, u, dt_s), F);
  return F.transpose();
}

Covariance process_noise(const ImuNoise& noise, double dt_s) {
  Covariance Q = Covariance::Zero();
  add_process_noise(noise, dt_s, Q);
  return Q;
}

void propagate_covariance(const NominalState& x, const InertialInput& u, const ImuNoise& noise,
                          double dt_s, Covariance& P) {
  const TransitionBlocks F = transition_blocks(x, u, dt_s);
  multiply_right(F, P);  // P F^T
  P.transposeInPlace();  // F P, since P was symmetric
  multiply_right(F, P);  // F P F^T
  add_process_noise(noise, dt_s, P);
  P = 0.5 * (P + P.transpose()).eval();
}

}  // namespace topoloc::estimation
