// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/pose_graph.hpp"

#include "topoloc/evaluation/median.hpp"
#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <array>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <stdexcept>
#include <utility>

#include <Eigen/Cholesky>

namespace topoloc::refinement {
namespace {

/// A pose is solved for as a motion (theta, t) away from where it starts, in its own axes.
using Motion = std::array<double, 6>;

template <typename T>
struct Pose {
  Eigen::Matrix<T, 3, 3> R;
  Eigen::Matrix<T, 3, 1> p;
};

/// moved(start, motion)
template <typename T>
Pose<T> pose_of(const RigidTransform& start, const T* motion) {
  Eigen::Matrix<T, 3, 3> Exp;
  ceres::AngleAxisToRotationMatrix(motion, Exp.data());
  const Eigen::Matrix<T, 3, 3> R = start.R.cast<T>();
  const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(motion + 3);
  return {R * Exp, R * t + start.p.cast<T>()};
}

/// (Log(R_ref^T R), R_ref^T (p - p_ref))
template <typename T>
Eigen::Matrix<T, 6, 1> away_from(const RigidTransform& reference, const Eigen::Matrix<T, 3, 3>& R,
                                 const Eigen::Matrix<T, 3, 1>& p) {
  const Eigen::Matrix<T, 3, 3> R_inverse = reference.R.transpose().cast<T>();
  const Eigen::Matrix<T, 3, 3> turned = R_inverse * R;
  Eigen::Matrix<T, 6, 1> xi;
  ceres::RotationMatrixToAngleAxis(turned.data(), xi.data());
  xi.template tail<3>() = R_inverse * (p - reference.p.cast<T>());
  return xi;
}

struct AbsoluteResidual {
  RigidTransform start;
  RigidTransform measured;
  Matrix6 whitening;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const Pose<T> pose = pose_of(start, motion);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    r = whitening.cast<T>() * away_from<T>(measured, pose.R, pose.p);
    return true;
  }
};

struct OdometryResidual {
  RigidTransform start_from;
  RigidTransform start_to;
  RigidTransform T_from_to;
  double seconds;
  Vector6 inverse_std;

  template <typename T>
  bool operator()(const T* motion_from, const T* motion_to, const T* rate_error,
                  const T* gyro_error, const T* turn_error, const T* scale_error,
                  T* residual) const {
    const Pose<T> from = pose_of(start_from, motion_from);
    const Pose<T> to = pose_of(start_to, motion_to);
    const Eigen::Matrix<T, 3, 3> R = from.R.transpose() * to.R;
    // Odometry has the way turned and scaled.
    const Eigen::Matrix<T, 3, 1> way = T_from_to.p.cast<T>();
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> turn(turn_error);
    const Eigen::Matrix<T, 3, 1> p =
        from.R.transpose() * (to.p - from.p) + *scale_error * way + turn.cross(way);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    Eigen::Matrix<T, 6, 1> xi = away_from<T>(T_from_to, R, p);
    const Eigen::Map<const Eigen::Matrix<T, 3, 3>> gyro(gyro_error);
    xi.template head<3>() += T(seconds) * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(rate_error) +
                             gyro * so3::log(T_from_to.R).cast<T>();
    r = inverse_std.cast<T>().cwiseProduct(xi);
    return true;
  }
};

struct GravityResidual {
  static constexpr double kGravity_mps2 = 9.81;
  RigidTransform start;
  Eigen::Vector3d up_imu;
  double std_rad;

  template <typename T>
  bool operator()(const T* motion, const T* force_error, T* residual) const {
    const Eigen::Matrix<T, 3, 1> up = pose_of(start, motion).R.row(2).transpose();
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> error(force_error);
    Eigen::Map<Eigen::Matrix<T, 3, 1>> r(residual);
    r = (up + error / T(kGravity_mps2) - up_imu.cast<T>()) / T(std_rad);
    return true;
  }
};

struct GroundResidual {
  RigidTransform start;
  Ground ground;
  double std_m;

  template <typename T>
  bool operator()(const T* motion, const T* height, T* residual) const {
    const Eigen::Matrix<T, 3, 1> p = pose_of(start, motion).p;
    const Eigen::Matrix<T, 2, 1> way = p.template head<2>() - ground.place.cast<T>();
    const T road = T(ground.height_m) + ground.slope.cast<T>().dot(way);
    residual[0] = (p.z() - road - *height) / T(std_m);
    return true;
  }
};

/// A constant error of a sensor is about zero.
template <int kAxes>
struct SensorErrorResidual {
  double std;

  template <typename T>
  bool operator()(const T* error, T* residual) const {
    for (int i = 0; i < kAxes; ++i) {
      residual[i] = error[i] / std;
    }
    return true;
  }
};

/// Where the track's point, slid along its surface with the first camera, appears in the second.
struct TrackResidual {
  RigidTransform start_from;
  RigidTransform start_to;
  const RigidTransform& T_imu_cam;
  const PinholeCamera& camera;
  const SurfaceTrack& track;

  template <typename T>
  bool operator()(const T* motion_from, const T* motion_to, T* residual) const {
    const Pose<T> from = pose_of(start_from, motion_from);
    const Pose<T> to = pose_of(start_to, motion_to);
    const Eigen::Matrix<T, 3, 3> R_imu_cam = T_imu_cam.R.cast<T>();
    const Eigen::Matrix<T, 3, 1> p_imu_cam = T_imu_cam.p.cast<T>();
    const Eigen::Matrix<T, 3, 1> ray_imu =
        (T_imu_cam.R * camera.ray(track.from.pixel_px)).cast<T>();
    const Eigen::Matrix<T, 3, 1> origin = from.R * p_imu_cam + from.p;
    const Eigen::Matrix<T, 3, 1> direction = from.R * ray_imu;
    const Eigen::Matrix<T, 3, 1> x_world = meet<T>(origin, direction, track.from.plane_world);
    const Eigen::Matrix<T, 3, 1> q =
        R_imu_cam.transpose() * (to.R.transpose() * (x_world - to.p) - p_imu_cam);
    if (!(q.z() > T(0.1))) {
      return false;
    }
    residual[0] = (camera.fx_px * q.x() / q.z() + camera.cx_px - track.to_px.x()) / track.std_px;
    residual[1] = (camera.fy_px * q.y() / q.z() + camera.cy_px - track.to_px.y()) / track.std_px;
    return true;
  }
};

Matrix6 inverse_root(const Matrix6& covariance) {
  const Eigen::LLT<Matrix6> inverse(covariance.inverse());
  if (inverse.info() != Eigen::Success) {
    throw std::invalid_argument("registration: its covariance is not positive definite");
  }
  return inverse.matrixU();
}

/// The point is in front of both cameras still, about where it was found: a ray that has become
/// parallel to its surface meets it anywhere.
bool is_sound(const TrackResidual& residual) {
  const Motion still{};
  Eigen::Vector2d r;
  constexpr double kFarOff = 100.0;  // deviations
  return residual(still.data(), still.data(), r.data()) && r.norm() < kFarOff;
}

/// Median height above ground of the keyframes that know their ground.
double median_height(const std::vector<GroundFactor>& factors,
                     const std::vector<RigidTransform>& poses) {
  std::vector<double> heights;
  for (const GroundFactor& factor : factors) {
    if (factor.keyframe < poses.size()) {
      heights.push_back(poses[factor.keyframe].p.z() - factor.ground.height_m);
    }
  }
  return evaluation::median(std::move(heights));
}

/// The graph as Ceres sees it.
class Problem {
 public:
  Problem(const PoseGraph& graph, const RigidTransform& T_imu_cam, const PinholeCamera& camera,
          std::size_t first, const SolverConfig& config, const std::vector<RigidTransform>& poses)
      : first_(first), poses_(poses), motions_(poses.size(), Motion{}) {
    for (const OdometryFactor& factor : graph.odometry) {
      if (moves(factor.from, factor.to)) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<OdometryResidual, 6, 6, 6, 3, 9, 3, 1>(
                new OdometryResidual{poses[factor.from], poses[factor.to], factor.T_from_to,
                                     factor.seconds, factor.std.cwiseInverse()}),
            nullptr, motions_[factor.from].data(), motions_[factor.to].data(), rate_error_.data(),
            gyro_error_.data(), turn_error_.data(), scale_error_.data());
      }
    }
    if (!graph.odometry.empty()) {
      add_sensor_error(graph.rate_error_std_radps, rate_error_);
      add_sensor_error(graph.gyro_scale_std, gyro_error_);
      add_sensor_error(graph.turn_error_std_rad, turn_error_);
      add_sensor_error(graph.scale_error_std, scale_error_);
    }
    for (const GravityFactor& factor : graph.gravity) {
      if (moves(factor.keyframe, factor.keyframe)) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<GravityResidual, 3, 6, 3>(
                new GravityResidual{poses[factor.keyframe], factor.up_imu, factor.std_rad}),
            nullptr, motions_[factor.keyframe].data(), force_error_.data());
      }
    }
    if (!graph.gravity.empty()) {
      add_sensor_error(graph.force_error_std_mps2, force_error_);
    }
    for (const GroundFactor& factor : graph.ground) {
      if (moves(factor.keyframe, factor.keyframe)) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<GroundResidual, 1, 6, 1>(
                new GroundResidual{poses[factor.keyframe], factor.ground, factor.std_m}),
            new ceres::HuberLoss(config.ground_loss), motions_[factor.keyframe].data(), &height_m_);
      }
    }
    height_m_ = median_height(graph.ground, poses);
    for (const PriorFactor& factor : graph.priors) {
      if (moves(factor.keyframe, factor.keyframe)) {
        const Matrix6 whitening = factor.std.cwiseInverse().asDiagonal();
        add_absolute(factor.keyframe, factor.T_world_imu, whitening,
                     new ceres::CauchyLoss(config.prior_loss));
      }
    }
    for (const Registration& factor : graph.registrations) {
      if (moves(factor.keyframe, factor.keyframe)) {
        const Matrix6 whitening = inverse_root(factor.shared_by * factor.covariance);
        add_absolute(factor.keyframe, factor.T_world_imu, whitening,
                     new ceres::HuberLoss(config.registration_loss));
      }
    }
    for (const TrackFactor& factor : graph.tracks) {
      if (!moves(factor.from, factor.to)) {
        continue;
      }
      const double share =
          std::min(1.0, config.tracks_per_pair /
                            std::max<double>(1.0, static_cast<double>(factor.tracks.size())));
      for (const SurfaceTrack& track : factor.tracks) {
        if (!is_sound({poses[factor.from], poses[factor.to], T_imu_cam, camera, track})) {
          continue;
        }
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<TrackResidual, 2, 6, 6>(
                new TrackResidual{poses[factor.from], poses[factor.to], T_imu_cam, camera, track}),
            new ceres::ScaledLoss(new ceres::CauchyLoss(config.track_loss), share,
                                  ceres::TAKE_OWNERSHIP),
            motions_[factor.from].data(), motions_[factor.to].data());
      }
    }
    for (std::size_t i = 0; i < first_ && i < motions_.size(); ++i) {
      if (problem_.HasParameterBlock(motions_[i].data())) {
        problem_.SetParameterBlockConstant(motions_[i].data());
      }
    }
  }

  void solve(const SolverConfig& config, std::vector<RigidTransform>& poses) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = config.max_iterations;
    options.num_threads = 1;  // sums in one order: the same result every time
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) {
      throw std::runtime_error("pose graph: no solution: " + summary.message);
    }
    for (std::size_t i = first_; i < poses.size(); ++i) {
      poses[i] = moved(poses_[i], Eigen::Map<const Vector6>(motions_[i].data()));
    }
  }

  std::vector<Matrix6> covariances() {
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const Motion& motion : motions_) {
      blocks.emplace_back(motion.data(), motion.data());
    }
    ceres::Covariance::Options options;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    if (!covariance.Compute(blocks, &problem_)) {
      throw std::runtime_error("pose graph: poses are not determined; no covariance");
    }
    std::vector<Matrix6> result;
    for (const Motion& motion : motions_) {
      Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
      covariance.GetCovarianceBlock(motion.data(), motion.data(), block.data());
      result.push_back(0.5 * (block + block.transpose()));
    }
    return result;
  }

 private:
  [[nodiscard]] bool moves(std::size_t from, std::size_t to) const {
    return (from >= first_ || to >= first_) && from < poses_.size() && to < poses_.size();
  }
  template <std::size_t kAxes>
  void add_sensor_error(double std, std::array<double, kAxes>& error) {
    if (std == 0.0) {  // there is none
      problem_.SetParameterBlockConstant(error.data());
      return;
    }
    constexpr int kSize = static_cast<int>(kAxes);
    using Residual = SensorErrorResidual<kSize>;
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Residual, kSize, kSize>(new Residual{std}), nullptr,
        error.data());
  }
  void add_absolute(std::size_t keyframe, const RigidTransform& measured, const Matrix6& whitening,
                    ceres::LossFunction* loss) {
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<AbsoluteResidual, 6, 6>(
                                  new AbsoluteResidual{poses_[keyframe], measured, whitening}),
                              loss, motions_[keyframe].data());
  }

  std::size_t first_;
  std::vector<RigidTransform> poses_;
  std::vector<Motion> motions_;
  std::array<double, 3> rate_error_{};  // [rad/s]
  std::array<double, 9> gyro_error_{};  // of scale and axes, by columns
  std::array<double, 3> turn_error_{};  // [rad]
  std::array<double, 1> scale_error_{};
  std::array<double, 3> force_error_{};  // [m/s^2]
  double height_m_ = 0.0;                // of the vehicle above the road
  ceres::Problem problem_;
};

}  // namespace

void solve(const PoseGraph& graph, const RigidTransform& T_imu_cam, const PinholeCamera& camera,
           std::size_t first, const SolverConfig& config, std::vector<RigidTransform>& poses) {
  Problem(graph, T_imu_cam, camera, first, config, poses).solve(config, poses);
}

std::vector<Matrix6> covariances(const PoseGraph& graph, const RigidTransform& T_imu_cam,
                                 const PinholeCamera& camera, const SolverConfig& config,
                                 const std::vector<RigidTransform>& poses) {
  return Problem(graph, T_imu_cam, camera, 0, config, poses).covariances();
}

std::vector<double> track_residuals_px(const TrackFactor& factor, const RigidTransform& T_imu_cam,
                                       const PinholeCamera& camera,
                                       const std::vector<RigidTransform>& poses) {
  const Motion still{};
  std::vector<double> norms;
  for (const SurfaceTrack& track : factor.tracks) {
    Eigen::Vector2d r;
    if (TrackResidual{poses[factor.from], poses[factor.to], T_imu_cam, camera, track}(
            still.data(), still.data(), r.data())) {
      norms.push_back(r.norm() * track.std_px);
    }
  }
  return norms;
}

}  // namespace topoloc::refinement
