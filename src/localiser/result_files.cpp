// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/result_files.hpp"

#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <fmt/ostream.h>

namespace topoloc::localiser {
namespace {

/// Name of a file that is not finished; removes it unless it gets its final name.
class PartialFile {
 public:
  explicit PartialFile(std::filesystem::path path) : path_(std::move(path)), partial_(path_) {
    partial_ += ".partial";
    if (std::filesystem::exists(path_) && !std::filesystem::is_regular_file(path_)) {
      throw std::runtime_error(path_.string() + ": is there and not a regular file");
    }
  }
  ~PartialFile() {
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  [[nodiscard]] const std::filesystem::path& partial() const { return partial_; }
  void publish() const {
    std::error_code error;
    std::filesystem::rename(partial_, path_, error);
    if (error) {
      throw std::runtime_error(path_.string() + ": cannot be written: " + error.message());
    }
  }

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_;
};

std::ofstream open(const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  if (!out) {
    throw std::runtime_error(file.string() + ": cannot be written");
  }
  return out;
}

void close(std::ofstream& out, const std::filesystem::path& file) {
  out.close();
  if (!out) {
    throw std::runtime_error(file.string() + ": writing failed (disk full?)");
  }
}

void write_header(std::ofstream& out) {
  out << "time_ns,px,py,pz,qx,qy,qz,qw,vx,vy,vz,bax,bay,baz,bgx,bgy,bgz,gx,gy,gz,mode";
  for (int row = 0; row < 6; ++row) {
    for (int col = row; col < 6; ++col) {
      fmt::print(out, ",c{}{}", row, col);
    }
  }
  out << ",reasons,since_fix_s,since_fix_m\n";
}

void write_state(std::ofstream& out, const estimation::Estimate& e) {
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

void write_updates(const std::filesystem::path& file, std::span<const FrameRecord> frames) {
  std::ofstream out = open(file);
  out << "frame,time_ns,matching,node_id,nodes,damaged_nodes,guided,features,raw_matches,"
         "without_depth,behind_camera,outliers,over_capacity,matches,update,iterations,invalid,"
         "outside_gate,inliers,rms_px,test_ratio,jump_m,min_information_rotation,"
         "min_information_position\n";
  for (const FrameRecord& frame : frames) {
    const matching::FrameReport& m = frame.matching;
    fmt::print(out, "{},{},{},{},{},{},{},{},{},{},{},{},{},{}", frame.frame_index, frame.time_ns,
               matching::to_string(m.verdict), m.node_count > 0 ? m.node_ids[0] : 0U, m.node_count,
               m.damaged_nodes, m.guided ? 1 : 0, m.features, m.raw_matches, m.without_depth,
               m.behind_camera, m.outliers, m.over_capacity, m.matches);
    if (!frame.update) {
      out << ",,,,,,,,,,\n";
      continue;
    }
    const estimation::MapUpdateResult& u = frame.update->result;
    const Eigen::Matrix<double, 6, 1> information = u.information.diagonal();
    fmt::print(out, ",{},{},{},{},{},{:.4f},{:.4f},{:.4f},{:.6g},{:.6g}\n",
               estimation::name(u.verdict), u.iterations, u.invalid, u.outside_gate, u.inliers,
               u.rms_px, u.test_ratio, frame.update->jump_m, information.head<3>().minCoeff(),
               information.tail<3>().minCoeff());
  }
  close(out, file);
}

}  // namespace

struct ResultFiles::Impl {
  explicit Impl(const std::filesystem::path& trajectory)
      : trajectory_file(trajectory),
        states_file(evaluation::beside(trajectory, ".states.csv")),
        updates_file(evaluation::beside(trajectory, ".updates.csv")),
        poses(trajectory_file.partial()),
        states(open(states_file.partial())) {
    write_header(states);
  }

  PartialFile trajectory_file;
  PartialFile states_file;
  PartialFile updates_file;
  evaluation::TumWriter poses;
  std::ofstream states;
};

ResultFiles::ResultFiles(const std::filesystem::path& trajectory)
    : impl_(std::make_unique<Impl>(trajectory)) {}
ResultFiles::~ResultFiles() = default;

void ResultFiles::add(const estimation::Estimate& estimate) {
  impl_->poses.write({.time_ns = estimate.time_ns, .T_world_imu = estimate.state.T_world_imu()});
  write_state(impl_->states, estimate);
}

void ResultFiles::finish(std::span<const FrameRecord> frames) {
  impl_->poses.close();
  close(impl_->states, impl_->states_file.partial());
  write_updates(impl_->updates_file.partial(), frames);
  impl_->updates_file.publish();
  impl_->states_file.publish();
  impl_->trajectory_file.publish();
}

}  // namespace topoloc::localiser
