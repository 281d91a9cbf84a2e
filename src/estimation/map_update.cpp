// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/map_update.hpp"

#include "topoloc/estimation/manifold_prior.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace topoloc::estimation {

using namespace error_index;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

double robust_weight(RobustKernel kernel, double r_over_width_sq) {
  switch (kernel) {
    case RobustKernel::kNone:
      break;
    case RobustKernel::kHuber:
      return r_over_width_sq > 1.0 ? 1.0 / std::sqrt(r_over_width_sq) : 1.0;
    case RobustKernel::kCauchy:
      return 1.0 / (1.0 + r_over_width_sq);
  }
  return 1.0;
}

bool usable(const MapMatchSet& set, const MapMatch& match) {
  return match.pixel_px.allFinite() && match.p_world_m.allFinite() && match.pixel_std_px > 0.0 &&
         std::isfinite(match.pixel_std_px) && match.node_slot >= 0 &&
         match.node_slot < set.node_count;
}

bool well_formed(const MapMatchSet& set) {
  if (set.match_count < 0 || set.match_count > kMaxMatches || set.node_count < 0 ||
      set.node_count > kMaxMatchedNodes || set.matches.size() < kMaxMatches) {
    return false;
  }
  return std::all_of(set.nodes.begin(), set.nodes.begin() + set.node_count,
                     [](const MatchedNode& node) {
                       return node.covariance.allFinite() && node.R_world_cam.allFinite() &&
                              node.p_world_cam.allFinite();
                     });
}

}  // namespace

const char* name(MapVerdict verdict) {
  switch (verdict) {
    case MapVerdict::kAccepted:
      return "accepted";
    case MapVerdict::kTooFewMatches:
      return "too_few_matches";
    case MapVerdict::kTooFewInGate:
      return "too_few_in_gate";
    case MapVerdict::kInnovationTooLarge:
      return "innovation_too_large";
    case MapVerdict::kNotFinite:
      return "not_finite";
  }
  return "unknown";
}

MapUpdate::MapUpdate(const CameraModel& camera, const MapUpdateConfig& config)
    : camera_(camera), config_(config), rows_(kMaxMatches) {}

// Rows that fall behind the camera leave the gate for good.
void MapUpdate::linearise(const MapMatchSet& set, const NominalState& x) {
  const RigidTransform T_cam_world = camera_pose(x, camera_);
  vehicle_motion_ = vehicle_motion(x, camera_);
  for (int slot = 0; slot < set.node_count; ++slot) {
    const MatchedNode& node = set.nodes[static_cast<std::size_t>(slot)];
    nodes_[static_cast<std::size_t>(slot)].motion = body_motion(
        T_cam_world * RigidTransform{node.R_world_cam, node.p_world_cam}, T_cam_world.R);
  }
  for (int i = 0; i < set.match_count; ++i) {
    Row& row = rows_[static_cast<std::size_t>(i)];
    if (!row.in_gate) {
      continue;
    }
    const MapMatch& match = set.matches[static_cast<std::size_t>(i)];
    const auto m =
        linearise_reprojection(camera_.pinhole, T_cam_world, match.pixel_px, match.p_world_m);
    row.in_gate = m.has_value();
    if (m) {
      row.at = *m;
    }
  }
}

// At the prior a residual carries the prior's and the node's error too: the gate and the first
// robust weight are by the innovation covariance S, not by the pixel noise.
void MapUpdate::gate(const MapMatchSet& set, const Covariance& P, MapUpdateResult& result) {
  const Matrix6 P_vehicle = vehicle_motion_ * P.topLeftCorner<6, 6>() * vehicle_motion_.transpose();
  std::array<Matrix6, kMaxMatchedNodes> P_motion;  // covariance of (omega, tau), by node
  for (int slot = 0; slot < set.node_count; ++slot) {
    const auto n = static_cast<std::size_t>(slot);
    P_motion[n] =
        P_vehicle + nodes_[n].motion * set.nodes[n].covariance * nodes_[n].motion.transpose();
  }
  for (int i = 0; i < set.match_count; ++i) {
    Row& row = rows_[static_cast<std::size_t>(i)];
    if (!row.in_gate) {
      continue;
    }
    const MapMatch& match = set.matches[static_cast<std::size_t>(i)];
    const double variance = match.pixel_std_px * match.pixel_std_px;
    Eigen::Matrix2d S =
        row.at.G * P_motion[static_cast<std::size_t>(match.node_slot)] * row.at.G.transpose();
    S.diagonal().array() += variance;
    const double chi2 = row.at.z_px.dot(S.inverse() * row.at.z_px);
    row.in_gate = chi2 <= config_.match_gate_chi2;  // false for NaN
    if (!row.in_gate) {
      ++result.outside_gate;
      continue;
    }
    const double width_sq = config_.kernel_width_sigma * config_.kernel_width_sigma;
    row.weight = robust_weight(config_.kernel, chi2 / width_sq) / variance;
  }
}

// The pose errors of the nodes that go best with a step of the pose. Robust weights must look at
// what the matches do apart from it: an error common to all of a node's matches is no outlier.
void MapUpdate::estimate_node_errors(const MapMatchSet& set, const Vector6& step) {
  for (int slot = 0; slot < set.node_count; ++slot) {
    Node& node = nodes_[static_cast<std::size_t>(slot)];
    node.error_moves.setZero();
    if (node.uncertain) {
      node.error_moves =
          -node.motion * (node.posterior * (node.b_n + node.L_xn.transpose() * step));
    }
  }
}

Eigen::Vector2d MapUpdate::residual(const MapMatchSet& set, int i) const {
  const auto index = static_cast<std::size_t>(i);
  const auto slot = static_cast<std::size_t>(set.matches[index].node_slot);
  return rows_[index].at.z_px + rows_[index].at.G * nodes_[slot].error_moves;
}

void MapUpdate::reweight(const MapMatchSet& set) {
  for (int i = 0; i < set.match_count; ++i) {
    Row& row = rows_[static_cast<std::size_t>(i)];
    if (!row.in_gate) {
      continue;
    }
    const double std_px = set.matches[static_cast<std::size_t>(i)].pixel_std_px;
    const double width_px = config_.kernel_width_sigma * std_px;
    row.weight =
        robust_weight(config_.kernel, residual(set, i).squaredNorm() / (width_px * width_px)) /
        (std_px * std_px);
  }
}

MapUpdate::Information MapUpdate::accumulate(const MapMatchSet& set) {
  for (int slot = 0; slot < set.node_count; ++slot) {
    nodes_[static_cast<std::size_t>(slot)].L.setZero();
    nodes_[static_cast<std::size_t>(slot)].b.setZero();
  }
  for (int i = 0; i < set.match_count; ++i) {
    const Row& row = rows_[static_cast<std::size_t>(i)];
    if (!row.in_gate) {
      continue;
    }
    Node& node = node_of(set.matches[static_cast<std::size_t>(i)]);
    const Eigen::Matrix<double, 6, 2> GtW = row.at.G.transpose() * row.weight;
    node.L.noalias() += GtW * row.at.G;
    node.b.noalias() += GtW * row.at.z_px;
  }
  // The normal equations of our own pose error, each node's pose error marginalised.
  Information sum{Matrix6::Zero(), Vector6::Zero()};
  for (int slot = 0; slot < set.node_count; ++slot) {
    Node& node = nodes_[static_cast<std::size_t>(slot)];
    const Matrix6 L_x = vehicle_motion_.transpose() * node.L;
    sum.L += L_x * vehicle_motion_;
    sum.b += vehicle_motion_.transpose() * node.b;
    const Matrix6& Sigma = set.nodes[static_cast<std::size_t>(slot)].covariance;
    node.uncertain = !Sigma.isZero(0.0);
    if (!node.uncertain) {
      continue;
    }
    node.L_xn = L_x * node.motion;
    node.b_n = node.motion.transpose() * node.b;
    const Matrix6 L_nn = node.motion.transpose() * node.L * node.motion;
    // (L_nn + Sigma^-1)^-1 = Sigma (I + L_nn Sigma)^-1 also holds for a Sigma without inverse.
    const Matrix6 I_plus = Matrix6::Identity() + L_nn * Sigma;
    node.posterior = Sigma * I_plus.partialPivLu().solve(Matrix6::Identity());
    sum.L -= node.L_xn * node.posterior * node.L_xn.transpose();
    sum.b -= node.L_xn * (node.posterior * node.b_n);
  }
  sum.L = 0.5 * (sum.L + sum.L.transpose()).eval();
  return sum;
}

void MapUpdate::summarise(const MapMatchSet& set, MapUpdateResult& result) const {
  double sum_sq = 0.0;
  for (int i = 0; i < set.match_count; ++i) {
    const Row& row = rows_[static_cast<std::size_t>(i)];
    const double width_px =
        config_.kernel_width_sigma * set.matches[static_cast<std::size_t>(i)].pixel_std_px;
    const double residual_sq = row.in_gate ? residual(set, i).squaredNorm() : 0.0;
    if (row.in_gate && residual_sq <= width_px * width_px) {
      ++result.inliers;
      sum_sq += residual_sq;
    }
  }
  result.rms_px = result.inliers > 0 ? std::sqrt(sum_sq / result.inliers) : 0.0;
}

MapUpdateResult MapUpdate::apply(const MapMatchSet& set, NominalState& x, Covariance& P) {
  MapUpdateResult result;
  if (!well_formed(set)) {
    result.verdict = MapVerdict::kNotFinite;
    return result;
  }
  result.matches = set.match_count;
  for (int i = 0; i < set.match_count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    rows_[index].in_gate = usable(set, set.matches[index]);
  }
  linearise(set, x);
  for (int i = 0; i < set.match_count; ++i) {
    result.invalid += rows_[static_cast<std::size_t>(i)].in_gate ? 0 : 1;
  }
  if (set.match_count - result.invalid < config_.min_matches) {
    result.verdict = MapVerdict::kTooFewMatches;
    return result;
  }
  gate(set, P, result);
  const int in_gate = set.match_count - result.invalid - result.outside_gate;
  if (in_gate < config_.min_matches || in_gate < config_.min_gate_share * set.match_count) {
    result.verdict = MapVerdict::kTooFewInGate;
    return result;
  }

  const NominalState x_bar = x;
  NominalState x_k = x_bar;
  Covariance P_post = P;
  Eigen::Vector3d last_theta = Eigen::Vector3d::Zero();
  for (int k = 0; k < config_.max_iterations; ++k) {
    const Information sum = accumulate(set);
    const PriorAtIterate prior = prior_at_iterate(x_k, x_bar, P);
    // K = (I + P L)^-1 P H^T R^-1 and I - K H = (I + P L)^-1. L has only its (theta, p) block, so
    // (I + P L)^-1 y = y - P_:pose L (I + P_pose L)^-1 y_pose.
    const Matrix6 A = Matrix6::Identity() + prior.P.topLeftCorner<6, 6>() * sum.L;
    const Eigen::PartialPivLU<Matrix6> A_lu(A);
    // eq_x_tilde: dx = -K z - (I - K H) (J^k)^-1 (x_k boxminus x_bar)
    const ErrorVector y = prior.P.leftCols<6>() * sum.b + prior.offset;
    const Vector6 t = A_lu.solve(y.head<6>());
    const ErrorVector dx = prior.P.leftCols<6>() * (sum.L * t) - y;
    // eq_result_state: P = (I - K H) P
    const Eigen::Matrix<double, 6, kErrorDim> A_inv_P = A_lu.solve(prior.P.topRows<6>());
    P_post = prior.P;
    P_post.noalias() -= prior.P.leftCols<6>() * (sum.L * A_inv_P).eval();

    x_k = boxplus(x_k, dx);
    last_theta = dx.segment<3>(kTheta);
    result.iterations = k + 1;
    result.information = sum.L;
    linearise(set, x_k);
    estimate_node_errors(set, dx.head<6>());
    reweight(set);
    if (last_theta.norm() < config_.convergence_theta_rad &&
        dx.segment<3>(kP).norm() < config_.convergence_p_m) {
      break;
    }
  }
  move_to_updated_state(last_theta, P_post);
  if (!all_finite(x_k) || !P_post.allFinite()) {
    result.verdict = MapVerdict::kNotFinite;
    return result;
  }
  summarise(set, result);

  // The correction is distributed with at most the prior's covariance.
  constexpr double kRegularisation = 1e-12;  // a state that is switched off has no covariance
  const Vector6 correction = boxminus(x_k, x_bar).head<6>();
  const Matrix6 P_pose = P.topLeftCorner<6, 6>() + kRegularisation * Matrix6::Identity();
  result.test_ratio = correction.dot(P_pose.llt().solve(correction)) / config_.pose_gate_chi2;
  if (!(result.test_ratio <= 1.0)) {
    result.verdict = MapVerdict::kInnovationTooLarge;
    return result;
  }
  if (result.inliers < config_.min_matches) {
    result.verdict = MapVerdict::kTooFewInGate;
    return result;
  }
  x = x_k;
  P = P_post;
  return result;
}

}  // namespace topoloc::estimation
