// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/messages.hpp"

#include <algorithm>
#include <numeric>

namespace topoloc::live {
namespace {

namespace index = estimation::error_index;

void copy(const Eigen::Vector3d& v, double (&out)[3]) { std::copy_n(v.data(), 3, out); }

void copy(const Eigen::Matrix3d& R, double (&wxyz)[4]) {
  const Eigen::Quaterniond q = RigidTransform{R, Eigen::Vector3d::Zero()}.quaternion();
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

template <int kSize, typename Matrix>
void copy_rows(const Matrix& m, double* out) {
  Eigen::Map<Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>> rows(out);
  rows = m;
}

std::int64_t system_us(const TickOutput& output) {
  return (output.estimate.time_ns + output.system_offset_ns) / 1000;
}

/// All verdicts but "inserted".
template <typename ByVerdict>
std::uint64_t turned_away(const ByVerdict& counts) {
  return std::accumulate(counts.begin() + 1, counts.end(), std::uint64_t{0});
}

}  // namespace

bool has_pose(const TickOutput& output) {
  return output.estimate.mode != estimation::Mode::kUninitialised;
}

estimate_t to_estimate(const TickOutput& output) {
  const estimation::Estimate& e = output.estimate;
  estimate_t m{};
  m.utime = system_us(output);
  m.tick = static_cast<std::int64_t>(output.tick);
  copy(e.state.p_world_imu, m.position);
  copy(e.state.R_world_imu, m.orientation);
  copy(e.state.v_world_imu, m.velocity);
  copy(e.state.accel_bias_mps2, m.accel_bias);
  copy(e.state.gyro_bias_radps, m.gyro_bias);
  copy(e.state.gravity_mps2, m.gravity);
  // Without a pose nothing is known, and zeros would say the contrary.
  constexpr double kUnknown = 1e12;
  const estimation::PoseCovariance unknown = kUnknown * estimation::PoseCovariance::Identity();
  copy_rows<6>(has_pose(output) ? e.P.topLeftCorner<6, 6>() : unknown, m.covariance);
  m.mode = static_cast<std::int8_t>(e.mode);
  m.reasons = static_cast<std::int32_t>(e.reasons);
  m.since_fix_s = e.since_fix_s;
  m.since_fix_m = e.since_fix_m;
  m.last_jump_m = e.last_jump_m;
  m.resets = static_cast<std::int64_t>(e.counters.starts);
  m.map_accepted = static_cast<std::int64_t>(e.counters.map_accepted());
  m.map_rejected = static_cast<std::int64_t>(e.counters.map_rejected());
  m.data_rejected =
      static_cast<std::int64_t>(turned_away(e.counters.imu) + turned_away(e.counters.speed) +
                                turned_away(e.counters.matches));
  return m;
}

pose_t to_pose(const TickOutput& output) {
  const estimation::NominalState& x = output.estimate.state;
  pose_t m{};
  m.utime = system_us(output);
  copy(x.p_world_imu, m.pos);
  copy(x.v_world_imu, m.vel);
  copy(x.R_world_imu, m.orientation);
  copy(output.imu.angular_rate_radps - x.gyro_bias_radps, m.rotation_rate);
  copy(output.imu.specific_force_mps2 - x.accel_bias_mps2 +
           x.R_world_imu.transpose() * x.gravity_mps2,
       m.accel);
  return m;
}

void fill_geo_pose(const TickOutput& output, const Eigen::Vector3d& origin_m, geo_pose_t& message) {
  const estimation::Estimate& e = output.estimate;
  message.utime = system_us(output);
  copy(origin_m + e.state.p_world_imu, message.position);
  copy(e.state.R_world_imu, message.orientation);
  copy_rows<3>(e.P.block<3, 3>(index::kP, index::kP), message.covariance);
  message.mode = static_cast<std::int8_t>(e.mode);
}

}  // namespace topoloc::live
