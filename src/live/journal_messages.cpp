// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "live/journal_messages.hpp"

#include <algorithm>

namespace topoloc::live {
namespace {

template <int kRows, int kCols>
using RowMajor =
    Eigen::Matrix<double, kRows, kCols, kCols == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

template <int kRows, int kCols>
void copy(const Eigen::Matrix<double, kRows, kCols>& from, double* to) {
  Eigen::Map<RowMajor<kRows, kCols>> rows(to);
  rows = from;
}

template <int kRows, int kCols>
void copy(const double* from, Eigen::Matrix<double, kRows, kCols>& to) {
  to = Eigen::Map<const RowMajor<kRows, kCols>>(from);
}

bool fits(std::int32_t count, std::size_t capacity) {
  return count >= 0 && static_cast<std::size_t>(count) <= capacity;
}

}  // namespace

void to_message(const TickInput& tick, tick_t& message) {
  message.tick = static_cast<std::int64_t>(tick.tick);
  message.now_ns = tick.now_ns;
  message.system_offset_ns = tick.system_offset_ns;
  message.lost_before = static_cast<std::int64_t>(tick.lost_before);
  message.nimu = static_cast<std::int32_t>(tick.imu_count);
  message.imu.resize(tick.imu_count);
  for (std::size_t i = 0; i < tick.imu_count; ++i) {
    message.imu[i].time_ns = tick.imu[i].time_ns;
    copy(tick.imu[i].specific_force_mps2, message.imu[i].specific_force);
    copy(tick.imu[i].angular_rate_radps, message.imu[i].angular_rate);
  }
  message.nspeed = static_cast<std::int32_t>(tick.speed_count);
  message.speed.resize(tick.speed_count);
  for (std::size_t i = 0; i < tick.speed_count; ++i) {
    message.speed[i].time_ns = tick.speed[i].time_ns;
    message.speed[i].speed = tick.speed[i].speed_mps;
  }
  message.match_set = tick.match_set ? static_cast<std::int64_t>(*tick.match_set) : -1;
  const estimation::InitialPose pose = tick.initial_pose.value_or(estimation::InitialPose{});
  message.has_initial_pose = static_cast<std::int8_t>(tick.initial_pose ? 1 : 0);
  message.initial_pose_ns = pose.time_ns;
  copy(pose.T_world_imu.R, message.initial_rotation);
  copy(pose.T_world_imu.p, message.initial_position);
}

bool from_message(const tick_t& message, TickInput& tick) {
  if (!fits(message.nimu, tick.imu.size()) || !fits(message.nspeed, tick.speed.size())) {
    return false;
  }
  tick.tick = static_cast<std::uint64_t>(message.tick);
  tick.now_ns = message.now_ns;
  tick.system_offset_ns = message.system_offset_ns;
  tick.lost_before = static_cast<std::uint64_t>(message.lost_before);
  tick.imu_count = message.imu.size();
  for (std::size_t i = 0; i < message.imu.size(); ++i) {
    tick.imu[i].time_ns = message.imu[i].time_ns;
    copy(message.imu[i].specific_force, tick.imu[i].specific_force_mps2);
    copy(message.imu[i].angular_rate, tick.imu[i].angular_rate_radps);
  }
  tick.speed_count = message.speed.size();
  for (std::size_t i = 0; i < message.speed.size(); ++i) {
    tick.speed[i] = {.time_ns = message.speed[i].time_ns, .speed_mps = message.speed[i].speed};
  }
  tick.match_set.reset();
  if (message.match_set >= 0) {
    tick.match_set = static_cast<std::uint64_t>(message.match_set);
  }
  tick.initial_pose.reset();
  if (message.has_initial_pose != 0) {
    estimation::InitialPose& pose = tick.initial_pose.emplace();
    pose.time_ns = message.initial_pose_ns;
    copy(message.initial_rotation, pose.T_world_imu.R);
    copy(message.initial_position, pose.T_world_imu.p);
  }
  return true;
}

void set_pose(const std::optional<estimation::InitialPose>& pose, journal_start_t& message) {
  const estimation::InitialPose written = pose.value_or(estimation::InitialPose{});
  message.has_pose = static_cast<std::int8_t>(pose ? 1 : 0);
  message.pose_ns = written.time_ns;
  copy(written.T_world_imu.R, message.rotation);
  copy(written.T_world_imu.p, message.position);
}

std::optional<estimation::InitialPose> pose_of(const journal_start_t& message) {
  if (message.has_pose == 0) {
    return std::nullopt;
  }
  estimation::InitialPose pose;
  pose.time_ns = message.pose_ns;
  copy(message.rotation, pose.T_world_imu.R);
  copy(message.position, pose.T_world_imu.p);
  return pose;
}

void to_message(const NumberedMatchSet& set, match_set_t& message) {
  message.number = static_cast<std::int64_t>(set.number);
  message.frame_time_ns = set.set.frame_time_ns;
  message.nnodes = set.set.node_count;
  message.nodes.resize(static_cast<std::size_t>(set.set.node_count));
  for (std::size_t i = 0; i < message.nodes.size(); ++i) {
    const estimation::MatchedNode& node = set.set.nodes[i];
    message.nodes[i].node_id = node.node_id;
    copy(node.R_world_cam, message.nodes[i].rotation);
    copy(node.p_world_cam, message.nodes[i].position);
    copy(node.covariance, message.nodes[i].covariance);
  }
  message.nmatches = set.set.match_count;
  message.matches.resize(static_cast<std::size_t>(set.set.match_count));
  for (std::size_t i = 0; i < message.matches.size(); ++i) {
    const estimation::MapMatch& match = set.set.matches[i];
    copy(match.pixel_px, message.matches[i].pixel);
    copy(match.p_world_m, message.matches[i].point);
    message.matches[i].pixel_std = match.pixel_std_px;
    message.matches[i].node_slot = match.node_slot;
  }
}

bool from_message(const match_set_t& message, NumberedMatchSet& set) {
  if (!fits(message.nnodes, set.set.nodes.size()) ||
      !fits(message.nmatches, set.set.matches.size())) {
    return false;
  }
  set.number = static_cast<std::uint64_t>(message.number);
  set.set.frame_time_ns = message.frame_time_ns;
  set.set.node_count = message.nnodes;
  for (std::size_t i = 0; i < message.nodes.size(); ++i) {
    estimation::MatchedNode& node = set.set.nodes[i];
    node.node_id = static_cast<std::uint32_t>(message.nodes[i].node_id);
    copy(message.nodes[i].rotation, node.R_world_cam);
    copy(message.nodes[i].position, node.p_world_cam);
    copy(message.nodes[i].covariance, node.covariance);
  }
  set.set.match_count = message.nmatches;
  for (std::size_t i = 0; i < message.matches.size(); ++i) {
    estimation::MapMatch& match = set.set.matches[i];
    copy(message.matches[i].pixel, match.pixel_px);
    copy(message.matches[i].point, match.p_world_m);
    match.pixel_std_px = message.matches[i].pixel_std;
    match.node_slot = message.matches[i].node_slot;
  }
  return true;
}

}  // namespace topoloc::live
