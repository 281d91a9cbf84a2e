// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/result_files.hpp"

#include <fstream>
#include <stdexcept>

#include <fmt/core.h>
#include <fmt/ostream.h>

namespace topoloc::localiser {
namespace {

std::ofstream open(const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  if (!out) {
    throw std::runtime_error(file.string() + ": cannot be written");
  }
  return out;
}

void close(std::ofstream& out, const std::filesystem::path& file) {
  out.flush();
  if (!out) {
    throw std::runtime_error(file.string() + ": writing failed (disk full?)");
  }
}

std::filesystem::path with_suffix(std::filesystem::path trajectory, const char* suffix) {
  return trajectory.replace_extension(suffix);
}

}  // namespace

std::filesystem::path states_path(const std::filesystem::path& trajectory) {
  return with_suffix(trajectory, ".states.csv");
}

std::filesystem::path updates_path(const std::filesystem::path& trajectory) {
  return with_suffix(trajectory, ".updates.csv");
}

void write_trajectory(const std::filesystem::path& file, const BatchResult& result) {
  evaluation::Trajectory trajectory;
  trajectory.reserve(result.estimates.size());
  for (const estimation::Estimate& e : result.estimates) {
    trajectory.push_back({.time_ns = e.time_ns, .T_world_imu = e.state.T_world_imu()});
  }
  evaluation::write_tum(file, trajectory);
}

void write_states(const std::filesystem::path& file, const BatchResult& result) {
  std::ofstream out = open(file);
  out << "time_ns,px,py,pz,qx,qy,qz,qw,vx,vy,vz,bax,bay,baz,bgx,bgy,bgz,gx,gy,gz,mode";
  for (int row = 0; row < 6; ++row) {
    for (int col = row; col < 6; ++col) {
      fmt::print(out, ",c{}{}", row, col);
    }
  }
  out << ",reasons,since_fix_s,since_fix_m\n";
  for (const estimation::Estimate& e : result.estimates) {
    fmt::print(out, "{}", e.time_ns);
    const Eigen::Quaterniond q = e.state.T_world_imu().quaternion();
    const auto print = [&out](const Eigen::Vector3d& v) {
      fmt::print(out, ",{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
    };
    fmt::print(out, ",{:.6f},{:.6f},{:.6f}", e.state.p_world_imu.x(), e.state.p_world_imu.y(),
               e.state.p_world_imu.z());
    fmt::print(out, ",{:.9f},{:.9f},{:.9f},{:.9f}", q.x(), q.y(), q.z(), q.w());
    print(e.state.v_world_imu);
    print(e.state.accel_bias_mps2);
    print(e.state.gyro_bias_radps);
    print(e.state.gravity_mps2);
    fmt::print(out, ",{}", estimation::name(e.mode));
    for (int row = 0; row < 6; ++row) {
      for (int col = row; col < 6; ++col) {
        fmt::print(out, ",{:.9g}", e.P(row, col));
      }
    }
    fmt::print(out, ",{},{:.3f},{:.3f}\n", e.reasons, e.since_fix_s, e.since_fix_m);
  }
  close(out, file);
}

void write_updates(const std::filesystem::path& file, const BatchResult& result) {
  std::ofstream out = open(file);
  out << "frame,time_ns,matching,node_id,nodes,guided,features,raw_matches,without_depth,"
         "behind_camera,outliers,matches,update,iterations,invalid,outside_gate,inliers,rms_px,"
         "test_ratio,jump_m,min_information\n";
  for (const FrameRecord& frame : result.frames) {
    const matching::FrameReport& m = frame.matching;
    fmt::print(out, "{},{},{},{},{},{},{},{},{},{},{},{}", frame.frame_index, frame.time_ns,
               matching::to_string(m.verdict), m.node_count > 0 ? m.node_ids[0] : 0U, m.node_count,
               m.guided ? 1 : 0, m.features, m.raw_matches, m.without_depth, m.behind_camera,
               m.outliers, m.matches);
    if (!frame.update) {
      out << ",,,,,,,,,\n";
      continue;
    }
    const estimation::MapUpdateResult& u = frame.update->result;
    fmt::print(out, ",{},{},{},{},{},{:.4f},{:.4f},{:.4f},{:.6g}\n", estimation::name(u.verdict),
               u.iterations, u.invalid, u.outside_gate, u.inliers, u.rms_px, u.test_ratio,
               frame.update->jump_m, u.information.diagonal().minCoeff());
  }
  close(out, file);
}

}  // namespace topoloc::localiser
