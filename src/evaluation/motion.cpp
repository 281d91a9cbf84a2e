// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/motion.hpp"

#include "topoloc/evaluation/pose_errors.hpp"
#include "topoloc/geometry/so3.hpp"

#include "csv_table.hpp"

#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>

namespace topoloc::evaluation {
namespace {

constexpr double kEarthRadius_m = 6378137.0;
constexpr double kRadians = M_PI / 180.0;

/// First and second time derivative, at time zero, of the parabolas through `values` (rows).
struct Derivatives {
  Eigen::RowVectorXd first;
  Eigen::RowVectorXd second;
};

Derivatives fit_parabolas(const Eigen::VectorXd& time_s, const Eigen::MatrixXd& values) {
  Eigen::MatrixXd powers(time_s.size(), 3);
  powers.col(0).setOnes();
  powers.col(1) = time_s;
  powers.col(2) = time_s.cwiseAbs2();
  const Eigen::MatrixXd coefficients = powers.colPivHouseholderQr().solve(values);
  return {coefficients.row(1), 2.0 * coefficients.row(2)};
}

}  // namespace

std::vector<MotionSample> differentiate(const Trajectory& trajectory, double half_window_s) {
  constexpr std::ptrdiff_t kMinPerSide = 2;
  const auto half_window_ns = static_cast<std::int64_t>(half_window_s / kSecondsPerNs);
  const auto size = static_cast<std::ptrdiff_t>(trajectory.size());
  const auto at = [&](std::ptrdiff_t i) -> const StampedPose& {
    return trajectory[static_cast<std::size_t>(i)];
  };
  std::vector<MotionSample> samples;
  std::ptrdiff_t begin = 0;
  std::ptrdiff_t end = 0;
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    while (at(begin).time_ns < at(i).time_ns - half_window_ns) {
      ++begin;
    }
    while (end < size && at(end).time_ns <= at(i).time_ns + half_window_ns) {
      ++end;
    }
    if (i - begin < kMinPerSide || end - 1 - i < kMinPerSide) {
      continue;
    }
    const RigidTransform& T_i = at(i).T_world_imu;
    Eigen::VectorXd time_s(end - begin);
    Eigen::MatrixXd values(end - begin, 6);
    for (std::ptrdiff_t j = begin; j < end; ++j) {
      time_s[j - begin] = static_cast<double>(at(j).time_ns - at(i).time_ns) * kSecondsPerNs;
      values.row(j - begin) << (at(j).T_world_imu.p - T_i.p).transpose(),
          so3::log(T_i.R.transpose() * at(j).T_world_imu.R).transpose();
    }
    const Derivatives d = fit_parabolas(time_s, values);
    MotionSample sample;
    sample.time_ns = at(i).time_ns;
    sample.velocity_imu_mps = T_i.R.transpose() * d.first.head<3>().transpose();
    sample.rate_imu_radps = d.first.tail<3>().transpose();
    const Eigen::Vector3d acceleration_imu = T_i.R.transpose() * d.second.head<3>().transpose();
    sample.forward_acceleration_mps2 =
        (acceleration_imu - sample.rate_imu_radps.cross(sample.velocity_imu_mps)).x();
    samples.push_back(sample);
  }
  return samples;
}

OxtsDrive read_oxts(const std::filesystem::path& path) {
  enum Column { kLat, kLon, kAlt, kRoll, kPitch, kYaw, kVf, kVl, kVu, kWx, kWy, kWz };
  const std::vector<CsvRow> rows =
      read_csv(path, "timestamp_ns",
               {"lat_deg", "lon_deg", "alt_m", "roll_rad", "pitch_rad", "yaw_rad", "vf_mps",
                "vl_mps", "vu_mps", "wx_radps", "wy_radps", "wz_radps"});
  OxtsDrive drive;
  std::vector<Eigen::Vector3d> positions;
  const double scale_m = kEarthRadius_m * std::cos(rows.front().values[kLat] * kRadians);
  for (const CsvRow& row : rows) {
    const auto& v = row.values;
    if (!(std::abs(v[kLat]) < 89.0)) {
      throw std::runtime_error(path.string() + ": latitude " + std::to_string(v[kLat]));
    }
    const double mercator = std::log(std::tan(M_PI / 4.0 + 0.5 * v[kLat] * kRadians));
    positions.emplace_back(scale_m * v[kLon] * kRadians, scale_m * mercator, v[kAlt]);
    const Eigen::Matrix3d R_level_imu = so3::exp({0, v[kPitch], 0}) * so3::exp({v[kRoll], 0, 0});
    MotionSample sample;
    sample.time_ns = row.time_ns;
    sample.velocity_imu_mps = R_level_imu.transpose() * Eigen::Vector3d(v[kVf], -v[kVl], v[kVu]);
    sample.rate_imu_radps = {v[kWx], v[kWy], v[kWz]};
    drive.samples.push_back(sample);
  }
  // Half a second is long enough to drown the rounding of the stamps, and short for a vehicle.
  constexpr std::size_t kSpan = 5;
  std::vector<double> disagreement;
  for (std::size_t i = kSpan; i + kSpan < rows.size(); ++i) {
    const double dt_s =
        static_cast<double>(rows[i + kSpan].time_ns - rows[i - kSpan].time_ns) * kSecondsPerNs;
    const double speed = (positions[i + kSpan] - positions[i - kSpan]).norm() / dt_s;
    disagreement.push_back(speed - drive.samples[i].velocity_imu_mps.norm());
  }
  if (disagreement.empty()) {
    throw std::runtime_error(path.string() + ": too short");
  }
  drive.speed_disagreement_mps = statistics(disagreement).p95;
  return drive;
}

}  // namespace topoloc::evaluation
