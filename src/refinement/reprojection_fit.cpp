// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/reprojection_fit.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/matching/predicted_camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace topoloc::refinement {
namespace {

/// Normal equations of one Gauss-Newton step.
struct NormalEquations {
  Matrix6 H = Matrix6::Zero();
  Vector6 b = Vector6::Zero();
  double cost = 0.0;
  double weighted_squares = 0.0;
};

NormalEquations normal_equations(std::span<const WorldMatch> matches,
                                 const RigidTransform& T_world_imu, const PosePrior& prior,
                                 const RigidTransform& T_imu_cam, const PinholeCamera& camera,
                                 const MatchConfig& config) {
  NormalEquations result;
  const RigidTransform T_imu_world = T_world_imu.inverse();
  const RigidTransform T_cam_imu = T_imu_cam.inverse();
  const double robust2 = config.robust_sigmas * config.robust_sigmas;
  for (const WorldMatch& match : matches) {
    const Eigen::Vector3d q_imu = T_imu_world * match.p_world;
    const Eigen::Vector3d q_cam = T_cam_imu * q_imu;
    if (!(q_cam.z() > matching::kMinDepth_m)) {
      continue;
    }
    // q_imu' = Exp(-theta) (q_imu - t)
    Eigen::Matrix<double, 3, 6> moves;
    moves << so3::skew(q_imu), -Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 2, 6> J =
        matching::projection_jacobian(camera, q_cam) * T_cam_imu.R * moves / config.pixel_std_px;
    const Eigen::Vector2d r = (camera.project(q_cam) - match.pixel_px) / config.pixel_std_px;
    const double weight = 1.0 / (1.0 + r.squaredNorm() / robust2);
    result.H += weight * J.transpose() * J;
    result.b -= weight * J.transpose() * r;
    result.cost += robust2 * std::log1p(r.squaredNorm() / robust2);
    result.weighted_squares += weight * r.squaredNorm();
  }
  result.H /= config.redundancy;
  result.b /= config.redundancy;
  result.cost /= config.redundancy;
  const Vector6 inverse_variance = (config.prior_weakening * prior.std).cwiseAbs2().cwiseInverse();
  const Vector6 away = motion_between(prior.T_world_imu, T_world_imu);
  result.H.diagonal() += inverse_variance;
  result.b -= inverse_variance.cwiseProduct(away);
  result.cost += away.cwiseAbs2().dot(inverse_variance);
  return result;
}

}  // namespace

ReprojectionFit fit_reprojection(std::span<const WorldMatch> matches, const RigidTransform& start,
                                 const PosePrior& prior, const RigidTransform& T_imu_cam,
                                 const PinholeCamera& camera, const MatchConfig& config) {
  constexpr int kSteps = 20;
  constexpr double kStill = 1e-8;
  const auto at = [&](const RigidTransform& T_world_imu) {
    return normal_equations(matches, T_world_imu, prior, T_imu_cam, camera, config);
  };
  ReprojectionFit fit{start, {}, 0.0, 0.0};
  NormalEquations equations = at(start);
  for (int i = 0; i < kSteps; ++i) {
    const Vector6 step = equations.H.ldlt().solve(equations.b);
    fit.T_world_imu = moved(fit.T_world_imu, step);
    equations = at(fit.T_world_imu);
    if (step.norm() < kStill) {
      break;
    }
  }
  constexpr double kParameters = 6.0;
  fit.information = equations.H;
  fit.mean_square = equations.weighted_squares /
                    std::max(1.0, 2.0 * static_cast<double>(matches.size()) - kParameters);
  fit.cost = equations.cost;
  return fit;
}

double reprojection_error(const WorldMatch& match, const RigidTransform& T_world_imu,
                          const RigidTransform& T_imu_cam, const PinholeCamera& camera,
                          const MatchConfig& config) {
  const Eigen::Vector3d q_cam = (T_world_imu * T_imu_cam).inverse() * match.p_world;
  return q_cam.z() > matching::kMinDepth_m
             ? (camera.project(q_cam) - match.pixel_px).norm() / config.pixel_std_px
             : std::numeric_limits<double>::infinity();
}

}  // namespace topoloc::refinement
