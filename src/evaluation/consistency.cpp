// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/consistency.hpp"

#include "topoloc/evaluation/chi_square.hpp"
#include "topoloc/geometry/so3.hpp"

#include "csv_table.hpp"

#include <optional>
#include <string>

#include <Eigen/Cholesky>

namespace topoloc::evaluation {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kConfidence = 0.95;

template <int kDim>
std::optional<double> squared_mahalanobis(const Eigen::Matrix<double, kDim, kDim>& covariance,
                                          const Eigen::Matrix<double, kDim, 1>& error) {
  const Eigen::LLT<Eigen::Matrix<double, kDim, kDim>> llt(covariance);
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  return error.dot(llt.solve(error));
}

/// Sums one NEES over the steps.
class NeesSum {
 public:
  explicit NeesSum(int dof) : dof_(dof), limit_(chi_square_quantile(kConfidence, dof)) {}
  void add(double nees) {
    sum_ += nees;
    inside_ += nees <= limit_ ? 1 : 0;
    ++steps_;
  }
  [[nodiscard]] Nees result() const {
    Nees result;
    result.dof = dof_;
    if (steps_ == 0) {
      return result;
    }
    const auto n = static_cast<double>(steps_);
    result.mean = sum_ / n;
    result.lower = chi_square_quantile(0.5 * (1.0 - kConfidence), n * dof_) / n;
    result.upper = chi_square_quantile(0.5 * (1.0 + kConfidence), n * dof_) / n;
    result.inside_share = static_cast<double>(inside_) / n;
    return result;
  }

 private:
  int dof_;
  double limit_;
  double sum_ = 0.0;
  std::size_t inside_ = 0;
  std::size_t steps_ = 0;
};

}  // namespace

std::vector<StateEstimate> read_states(const std::filesystem::path& path) {
  std::vector<std::string> columns = {"px", "py", "pz", "qx", "qy", "qz", "qw"};
  const std::size_t first_covariance = columns.size();
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      columns.push_back("c" + std::to_string(row) + std::to_string(column));
    }
  }
  std::vector<StateEstimate> states;
  for (const CsvRow& row : read_csv(path, "time_ns", columns)) {
    const auto& v = row.values;
    StateEstimate state;
    state.time_ns = row.time_ns;
    state.T_world_imu = RigidTransform::from_quaternion({v[0], v[1], v[2]},
                                                        Eigen::Quaterniond(v[6], v[3], v[4], v[5]));
    std::size_t at = first_covariance;
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) {
        state.covariance(i, j) = state.covariance(j, i) = v[at++];
      }
    }
    states.push_back(state);
  }
  return states;
}

Consistency consistency(const Trajectory& reference, const std::vector<StateEstimate>& states,
                        std::int64_t begin_ns, std::int64_t max_gap_ns) {
  Consistency result;
  NeesSum attitude(3);
  NeesSum position(3);
  NeesSum pose(6);
  for (const StateEstimate& state : states) {
    if (state.time_ns < begin_ns) {
      continue;
    }
    const auto T_true = pose_at(reference, state.time_ns, max_gap_ns);
    if (!T_true) {
      ++result.outside_reference;
      continue;
    }
    const Eigen::Matrix3d P_theta = state.covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d P_p = state.covariance.bottomRightCorner<3, 3>();
    Vector6d error;
    error << so3::log(state.T_world_imu.R.transpose() * T_true->R), T_true->p - state.T_world_imu.p;
    const auto nees_theta = squared_mahalanobis<3>(P_theta, error.head<3>());
    const auto nees_p = squared_mahalanobis<3>(P_p, error.tail<3>());
    const auto nees_pose = squared_mahalanobis<6>(state.covariance, error);
    if (!nees_theta || !nees_p || !nees_pose) {
      ++result.not_positive_definite;
      continue;
    }
    attitude.add(*nees_theta);
    position.add(*nees_p);
    pose.add(*nees_pose);
    ++result.steps;
  }
  result.attitude = attitude.result();
  result.position = position.result();
  result.pose = pose.result();
  return result;
}

}  // namespace topoloc::evaluation
