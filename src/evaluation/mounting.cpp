// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/mounting.hpp"

#include "topoloc/geometry/so3.hpp"

#include "robust_fit.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::evaluation {
namespace {

constexpr std::size_t kMinFitSamples = 50;
constexpr double kMaxResidualStd_mps = 0.5;
/// What is assumed before looking: weak enough to vanish where the drive says anything.
constexpr double kPriorAngle_rad = 0.5;
constexpr double kPriorLever_m = 5.0;
constexpr double kPriorScale = 0.5;
constexpr double kPriorDelay_s = 0.5;
constexpr double kPriorSlip_s2pm = 0.05;
/// Worse than this a parameter is not worth writing down.
constexpr double kMaxAngleStd_rad = 0.005;
constexpr double kMaxLeverStd_m = 0.3;
constexpr double kMaxScaleStd = 0.005;
constexpr double kMaxDelayStd_s = 0.02;
constexpr double kMaxSlipStd_s2pm = 0.004;

Parameter parameter(const RobustFit& fit, Eigen::Index i, double max_std) {
  return {fit.x[i], fit.std[i], fit.std[i] <= max_std};
}

/// Velocities and rates of the used samples in vehicle axes, a row each.
struct VehicleMotion {
  Eigen::MatrixX3d v;
  Eigen::MatrixX3d w;
};

VehicleMotion rotated(const std::vector<MotionSample>& samples, const Eigen::Matrix3d& R) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  VehicleMotion motion{Eigen::MatrixX3d(n, 3), Eigen::MatrixX3d(n, 3)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const MotionSample& sample = samples[static_cast<std::size_t>(i)];
    motion.v.row(i) = (R * sample.velocity_imu_mps).transpose();
    motion.w.row(i) = (R * sample.rate_imu_radps).transpose();
  }
  return motion;
}

/// Lateral row of the model, to first order in the yaw correction psi:
/// v_y + psi v_x + w_z r_x - w_x r_z = 0; optionally with tyre slip, + slip v_x^2 w_z.
RobustFit fit_lateral(const VehicleMotion& m, bool with_slip) {
  Eigen::MatrixXd A(m.v.rows(), with_slip ? 4 : 3);
  A.col(0) = m.v.col(0);
  A.col(1) = m.w.col(2);
  A.col(2) = -m.w.col(0);
  Eigen::VectorXd prior(A.cols());
  prior.head<3>() << kPriorAngle_rad, kPriorLever_m, kPriorLever_m;
  if (with_slip) {
    A.col(3) = m.v.col(0).cwiseAbs2().cwiseProduct(m.w.col(2));
    prior[3] = kPriorSlip_s2pm;
  }
  return robust_fit(A, -m.v.col(1), prior);
}

/// Vertical row, to first order in the pitch correction theta: v_z - theta v_x + w_x r_y - w_y c =
/// 0. c is the pitch centre of the suspension, not the axle; it only keeps pitching out of theta.
RobustFit fit_vertical(const VehicleMotion& m) {
  Eigen::MatrixXd A(m.v.rows(), 3);
  A.col(0) = -m.v.col(0);
  A.col(1) = m.w.col(0);
  A.col(2) = -m.w.col(1);
  return robust_fit(A, -m.v.col(2), Eigen::Vector3d(kPriorAngle_rad, kPriorLever_m, kPriorLever_m));
}

/// Forward row: v_x + w_y r_z - w_z r_y = scale * wheel(t) + delay * dv_x/dt.
void fit_forward(const std::vector<MotionSample>& samples, const VehicleMotion& m, double lever_z_m,
                 MountingEstimate& estimate) {
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].wheel_speed_mps) {
      rows.push_back(static_cast<Eigen::Index>(i));
    }
  }
  if (rows.size() < kMinFitSamples) {
    return;
  }
  Eigen::MatrixXd A(rows.size(), 3);
  Eigen::VectorXd b(rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index i = rows[k];
    const auto row = static_cast<Eigen::Index>(k);
    const MotionSample& sample = samples[static_cast<std::size_t>(i)];
    A.row(row) << *sample.wheel_speed_mps, m.w(i, 2), sample.forward_acceleration_mps2;
    b[row] = m.v(i, 0) + m.w(i, 1) * lever_z_m - *sample.wheel_speed_mps;
  }
  const RobustFit fit =
      robust_fit(A, b, Eigen::Vector3d(kPriorScale, kPriorLever_m, kPriorDelay_s));
  estimate.wheel_scale = parameter(fit, 0, kMaxScaleStd);
  estimate.wheel_scale.value += 1.0;
  estimate.lever_y_m = parameter(fit, 1, kMaxLeverStd_m);
  estimate.wheel_delay_s = parameter(fit, 2, kMaxDelayStd_s);
  estimate.forward_std_mps = fit.residual_std;
}

/// The samples that are fast and straight enough; counts the others.
std::vector<MotionSample> usable(const std::vector<MotionSample>& samples,
                                 const MountingOptions& options, const Eigen::Matrix3d& R,
                                 MountingEstimate& estimate) {
  std::vector<MotionSample> used;
  for (const MotionSample& sample : samples) {
    const double forward_mps = (R * sample.velocity_imu_mps).x();
    const double yaw_rate_radps = (R * sample.rate_imu_radps).z();
    if (forward_mps < options.min_speed_mps) {
      ++estimate.too_slow;
    } else if (std::abs(forward_mps * yaw_rate_radps) > options.max_lateral_acceleration_mps2) {
      ++estimate.turning_too_hard;
    } else {
      used.push_back(sample);
    }
  }
  estimate.samples = used.size();
  return used;
}

}  // namespace

MountingEstimate estimate_mounting(const std::vector<MotionSample>& samples,
                                   const MountingOptions& options) {
  MountingEstimate estimate;
  estimate.mounting = options.given;
  Eigen::Matrix3d R = so3::from_roll_pitch_yaw(options.given.rotation_vehicle_imu_rpy_rad);
  const std::vector<MotionSample> used = usable(samples, options, R, estimate);
  if (used.size() < kMinFitSamples) {
    return estimate;
  }
  // The fits are linear in small corrections of the rotation: repeated, they need not be small.
  constexpr int kIterations = 8;
  RobustFit lateral;
  RobustFit vertical;
  for (int i = 0; i < kIterations; ++i) {
    const VehicleMotion motion = rotated(used, R);
    lateral = fit_lateral(motion, false);
    vertical = fit_vertical(motion);
    Eigen::Vector3d rpy_rad = so3::roll_pitch_yaw(so3::exp({0.0, vertical.x[0], lateral.x[0]}) * R);
    rpy_rad.x() = options.given.rotation_vehicle_imu_rpy_rad.x();
    R = so3::from_roll_pitch_yaw(rpy_rad);
  }
  estimate.lateral_std_mps = lateral.residual_std;
  estimate.vertical_std_mps = vertical.residual_std;
  const Eigen::Vector3d rpy_rad = so3::roll_pitch_yaw(R);
  estimate.pitch_rad = {rpy_rad.y(), vertical.std[0], vertical.std[0] <= kMaxAngleStd_rad};
  estimate.yaw_rad = {rpy_rad.z(), lateral.std[0], lateral.std[0] <= kMaxAngleStd_rad};
  if (std::max(lateral.residual_std, vertical.residual_std) > kMaxResidualStd_mps) {
    estimate.verdict = MountingVerdict::kResidualsTooLarge;
    return estimate;
  }
  const VehicleMotion motion = rotated(used, R);
  lateral = fit_lateral(motion, false);
  const RobustFit with_slip = fit_lateral(motion, true);
  estimate.lever_x_m = parameter(lateral, 1, kMaxLeverStd_m);
  estimate.lever_z_m = parameter(lateral, 2, kMaxLeverStd_m);
  estimate.lever_x_without_slip_m = parameter(with_slip, 1, kMaxLeverStd_m);
  estimate.slip_s2pm = parameter(with_slip, 3, kMaxSlipStd_s2pm);

  // Unobservable parameters keep what was given.
  Eigen::Vector3d& given_rpy = estimate.mounting.rotation_vehicle_imu_rpy_rad;
  given_rpy.y() = estimate.pitch_rad.observable ? estimate.pitch_rad.value : given_rpy.y();
  given_rpy.z() = estimate.yaw_rad.observable ? estimate.yaw_rad.value : given_rpy.z();
  const Eigen::Matrix3d R_final = so3::from_roll_pitch_yaw(given_rpy);
  Eigen::Vector3d lever = R_final * options.given.wheel_reference_imu_m;
  lever.x() = estimate.lever_x_m.observable ? estimate.lever_x_m.value : lever.x();
  lever.z() = estimate.lever_z_m.observable ? estimate.lever_z_m.value : lever.z();
  fit_forward(used, motion, lever.z(), estimate);
  lever.y() = estimate.lever_y_m.observable ? estimate.lever_y_m.value : lever.y();
  estimate.mounting.wheel_reference_imu_m = R_final.transpose() * lever;
  if (estimate.wheel_scale.observable) {
    estimate.mounting.wheel_scale = estimate.wheel_scale.value;
  }
  estimate.verdict = MountingVerdict::kOk;
  return estimate;
}

}  // namespace topoloc::evaluation
