// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/trajectory.hpp"

#include "topoloc/geometry/so3.hpp"

#include "simulation/cubic_weights.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::simulation {

BodyMotion BodyMotion::of(const RigidTransform& T_body_frame) const {
  const Eigen::Vector3d& lever = T_body_frame.p;
  const Eigen::Matrix3d& R = T_world_body.R;
  BodyMotion frame;
  frame.T_world_body = T_world_body * T_body_frame;
  frame.velocity_mps = velocity_mps + R * rate_radps.cross(lever);
  frame.acceleration_mps2 = acceleration_mps2 + R * (rate_change_radps2.cross(lever) +
                                                     rate_radps.cross(rate_radps.cross(lever)));
  frame.rate_radps = T_body_frame.R.transpose() * rate_radps;
  frame.rate_change_radps2 = T_body_frame.R.transpose() * rate_change_radps2;
  return frame;
}

Trajectory::Trajectory(std::vector<RigidTransform> controls, double spacing_s)
    : controls_(std::move(controls)), spacing_s_(spacing_s) {
  if (controls_.size() < 4 || !(spacing_s > 0.0)) {
    throw std::invalid_argument("a trajectory needs four control poses and a spacing");
  }
  duration_s_ = static_cast<double>(controls_.size() - 3) * spacing_s_;
  turns_.reserve(controls_.size() - 1);
  for (std::size_t i = 0; i + 1 < controls_.size(); ++i) {
    turns_.push_back(so3::log(controls_[i].R.transpose() * controls_[i + 1].R));
  }
}

BodyMotion Trajectory::at(double time_s) const {
  const double place = std::clamp(time_s, 0.0, duration_s_) / spacing_s_;
  const std::size_t first = std::min(static_cast<std::size_t>(place), controls_.size() - 4);
  const double u = place - static_cast<double>(first);
  const Eigen::Vector4d w0 = cubic_weights(u);
  const Eigen::Vector4d w1 = cubic_weights_1(u) / spacing_s_;
  const Eigen::Vector4d w2 = cubic_weights_2(u) / (spacing_s_ * spacing_s_);

  BodyMotion motion;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d& p = controls_[first + static_cast<std::size_t>(i)].p;
    motion.T_world_body.p += w0[i] * p;
    motion.velocity_mps += w1[i] * p;
    motion.acceleration_mps2 += w2[i] * p;
  }
  const Eigen::Vector3d c0 = cumulative(w0);
  const Eigen::Vector3d c1 = cumulative(w1);
  const Eigen::Vector3d c2 = cumulative(w2);
  motion.T_world_body.R = controls_[first].R;
  Eigen::Vector3d& rate = motion.rate_radps;
  Eigen::Vector3d& change = motion.rate_change_radps2;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d& turn = turns_[first + static_cast<std::size_t>(i)];
    const Eigen::Matrix3d A = so3::exp(c0[i] * turn);
    motion.T_world_body.R = motion.T_world_body.R * A;
    rate = A.transpose() * rate + c1[i] * turn;
    change = c1[i] * rate.cross(turn) + A.transpose() * change + c2[i] * turn;
  }
  return motion;
}

}  // namespace topoloc::simulation
