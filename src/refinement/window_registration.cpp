// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/window_registration.hpp"

#include "topoloc/evaluation/median.hpp"
#include "topoloc/refinement/normal_samples.hpp"

#include "refinement/parallel_for.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <opencv2/core/optim.hpp>

namespace topoloc::refinement {
namespace {

/// The agreement of a window as a function of its motion, in units of the search deviations.
class Agreement {
 public:
  Agreement(std::span<const WindowView> views, const RigidTransform& T_world_imu,
            const RigidTransform& T_imu_cam, const PinholeCamera& camera,
            const SearchConfig& config, double radial = 0.0)
      : T_world_imu_(T_world_imu),
        T_imu_cam_(T_imu_cam),
        camera_(camera),
        config_(config),
        radial_(radial) {
    for (const WindowView& view : views) {
      views_.push_back(view);
      patches_ += view.correlation->patches.size();
    }
  }

  [[nodiscard]] std::size_t patches() const { return patches_; }

  /// T_cam_world of all views when the window has moved by xi.
  [[nodiscard]] std::vector<RigidTransform> cameras(const Vector6& xi) const {
    // T_i' = T_ref D T_ref^-1 T_i: the window moves about the reference pose as one body.
    const RigidTransform motion = moved(T_world_imu_, xi) * T_world_imu_.inverse();
    std::vector<RigidTransform> T_cam_world;
    T_cam_world.reserve(views_.size());
    for (const WindowView& view : views_) {
      T_cam_world.push_back((motion * view.T_world_imu * T_imu_cam_).inverse());
    }
    return T_cam_world;
  }

  /// Sum over all patches.
  [[nodiscard]] double sum(const Vector6& xi, std::size_t level) const {
    const std::vector<RigidTransform> T_cam_world = cameras(xi);
    double total = 0.0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const ViewCorrelation& view = *views_[i].correlation;
      for (const CorrelationPatch& patch : view.patches) {
        total += agreement(view, patch, level, camera_, T_cam_world[i], radial_);
      }
    }
    return total;
  }

  /// Of each patch, view by view.
  [[nodiscard]] std::vector<double> each(const Vector6& xi, std::size_t level) const {
    const std::vector<RigidTransform> T_cam_world = cameras(xi);
    std::vector<double> values;
    values.reserve(patches_);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const ViewCorrelation& view = *views_[i].correlation;
      for (const CorrelationPatch& patch : view.patches) {
        values.push_back(agreement(view, patch, level, camera_, T_cam_world[i], radial_));
      }
    }
    return values;
  }

  /// Index of the piece of the scene that each patch shows: views of the same piece are not
  /// independent witnesses.
  [[nodiscard]] std::vector<std::size_t> pieces() const {
    constexpr double kPiece_m = 2.0;
    std::map<std::tuple<int, int, int>, std::size_t> numbers;
    std::vector<std::size_t> result;
    for (const WindowView& view : views_) {
      for (const CorrelationPatch& patch : view.correlation->patches) {
        const Eigen::Vector3i cell =
            ((patch.q_world - T_world_imu_.p) / kPiece_m).array().floor().cast<int>();
        result.push_back(
            numbers.try_emplace({cell.x(), cell.y(), cell.z()}, numbers.size()).first->second);
      }
    }
    return result;
  }

  /// What is climbed: agreement, less a penalty for leaving the start.
  [[nodiscard]] double objective(const Vector6& scaled, std::size_t level) const {
    return sum(config_.std.cwiseProduct(scaled), level) - penalty() * scaled.squaredNorm();
  }

  /// Cost of leaving the start by one deviation.
  [[nodiscard]] double penalty() const {
    return config_.prior_weight * static_cast<double>(views_.size());
  }

 private:
  std::vector<WindowView> views_;
  RigidTransform T_world_imu_;
  RigidTransform T_imu_cam_;
  PinholeCamera camera_;
  SearchConfig config_;
  double radial_;
  std::size_t patches_ = 0;
};

/// Nelder-Mead from a start, in scaled coordinates.
class Climber : public cv::MinProblemSolver::Function {
 public:
  Climber(const Agreement& agreement, std::size_t level) : agreement_(agreement), level_(level) {}

  [[nodiscard]] int getDims() const override { return 6; }
  double calc(const double* x) const override {
    return -agreement_.objective(Eigen::Map<const Vector6>(x), level_);
  }

 private:
  const Agreement& agreement_;
  std::size_t level_;
};

constexpr std::size_t kFinest = CorrelationConfig{}.smoothing.size() - 1;

struct Candidate {
  Vector6 scaled;
  double value;
};

Candidate climb(const Agreement& agreement, std::size_t level, const Vector6& start, double step) {
  constexpr int kMaxEvaluations = 400;
  constexpr double kTolerance = 1e-4;
  const auto solver = cv::DownhillSolver::create(
      cv::makePtr<Climber>(agreement, level), cv::Mat(1, 6, CV_64F, cv::Scalar(step)),
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kMaxEvaluations,
                       kTolerance));
  cv::Mat x(1, 6, CV_64F);
  Eigen::Map<Vector6>(x.ptr<double>()) = start;
  const double value = -solver->minimize(x);
  return {Eigen::Map<const Vector6>(x.ptr<double>()), value};
}

Candidate climb_all_levels(const Agreement& agreement, const Vector6& start) {
  Candidate candidate{start, 0.0};
  double step = 0.5;
  for (std::size_t level = 0; level <= kFinest; ++level, step *= 0.5) {
    candidate = climb(agreement, level, candidate.scaled, step);
  }
  return candidate;
}

/// Of the patches of all views; 0 without any.
double median_depth_m(std::span<const WindowView> views, const RigidTransform& T_imu_cam) {
  std::vector<double> depths_m;
  for (const WindowView& view : views) {
    const RigidTransform T_cam_world = (view.T_world_imu * T_imu_cam).inverse();
    for (const CorrelationPatch& patch : view.correlation->patches) {
      depths_m.push_back((T_cam_world * patch.q_world).z());
    }
  }
  return depths_m.empty() ? 0.0 : evaluation::median(std::move(depths_m));
}

/// Agreement of each piece of the scene.
std::vector<double> of_pieces(const Agreement& agreement, const Vector6& xi, std::size_t level) {
  const std::vector<std::size_t> pieces = agreement.pieces();
  const std::vector<double> values = agreement.each(xi, level);
  std::vector<double> sums(pieces.empty() ? 0
                                          : *std::max_element(pieces.begin(), pieces.end()) + 1);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    sums[pieces[i]] += values[i];
  }
  return sums;
}

/// Mean agreement of the pieces of the scene over its standard error.
double significance(const Agreement& agreement, const Vector6& xi, std::size_t level) {
  const std::vector<double> values = of_pieces(agreement, xi, level);
  const double square = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return square > 0.0 ? std::accumulate(values.begin(), values.end(), 0.0) / std::sqrt(square)
                      : 0.0;
}

/// Sandwich covariance at a maximum, by central differences. `std`: of the poses searched.
Matrix6 sandwich(const Agreement& agreement, const Vector6& xi, std::size_t level,
                 const Vector6& std) {
  constexpr double kStep_rad = 0.003;
  constexpr double kStep_m = 0.06;
  Vector6 step;
  step << kStep_rad, kStep_rad, kStep_rad, kStep_m, kStep_m, kStep_m;
  const auto offset = [&](int i, double factor) {
    Vector6 d = Vector6::Zero();
    d(i) = factor * step(i);
    return d;
  };
  // Gradients of each piece of the scene, and the curvature of the whole; in units of the steps.
  const std::vector<std::size_t> pieces = agreement.pieces();
  const std::size_t count =
      pieces.empty() ? 0 : *std::max_element(pieces.begin(), pieces.end()) + 1;
  Eigen::Matrix<double, Eigen::Dynamic, 6> gradients =
      Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(static_cast<Eigen::Index>(count), 6);
  Matrix6 H;
  const double here = agreement.sum(xi, level);
  for (int i = 0; i < 6; ++i) {
    const std::vector<double> ahead = agreement.each(xi + offset(i, 1.0), level);
    const std::vector<double> behind = agreement.each(xi + offset(i, -1.0), level);
    double sum = -2.0 * here;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      gradients(static_cast<Eigen::Index>(pieces[k]), i) += 0.5 * (ahead[k] - behind[k]);
      sum += ahead[k] + behind[k];
    }
    H(i, i) = -sum;
    for (int j = 0; j < i; ++j) {
      const double mixed = agreement.sum(xi + offset(i, 1.0) + offset(j, 1.0), level) -
                           agreement.sum(xi + offset(i, 1.0) + offset(j, -1.0), level) -
                           agreement.sum(xi + offset(i, -1.0) + offset(j, 1.0), level) +
                           agreement.sum(xi + offset(i, -1.0) + offset(j, -1.0), level);
      H(i, j) = H(j, i) = -0.25 * mixed;
    }
  }
  Matrix6 G = gradients.transpose() * gradients;
  // The penalty for leaving the start pulls, too, and in vain where the start is wrong. Where the
  // scene says nothing, neither curvature nor scatter, that leaves the variance of the start.
  const Vector6 pull = 2.0 * agreement.penalty() * step.cwiseQuotient(std).cwiseAbs2();
  H.diagonal() += pull;
  G.diagonal() += 2.0 * agreement.penalty() * pull;
  // A direction without curvature is unobserved: its variance must come out large, not negative.
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(H);
  const double least = 1e-3 * std::max(eigen.eigenvalues().maxCoeff(), 1e-9);
  const Matrix6 inverse = eigen.eigenvectors() *
                          eigen.eigenvalues().cwiseMax(least).cwiseInverse().asDiagonal() *
                          eigen.eigenvectors().transpose();
  const Matrix6 covariance = inverse * G * inverse;
  return step.asDiagonal() * (0.5 * (covariance + covariance.transpose())) * step.asDiagonal();
}

}  // namespace

Registration register_window(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                             const RigidTransform& T_imu_cam, const PinholeCamera& camera,
                             const SearchConfig& config) {
  const Agreement agreement(views, T_world_imu, T_imu_cam, camera, config);
  NormalSamples normal(config.seed);
  std::vector<Candidate> tried(static_cast<std::size_t>(config.samples));
  for (std::size_t i = 0; i < tried.size(); ++i) {
    for (int k = 0; k < 6; ++k) {
      tried[i].scaled(k) = i == 0 ? 0.0 : normal();
    }
  }
  parallel_for(tried.size(), config.threads,
               [&](std::size_t i) { tried[i].value = agreement.objective(tried[i].scaled, 0); });
  std::stable_sort(tried.begin(), tried.end(),
                   [](const Candidate& a, const Candidate& b) { return a.value > b.value; });
  tried.resize(std::min(tried.size(), static_cast<std::size_t>(config.starts)));
  parallel_for(tried.size(), config.threads,
               [&](std::size_t i) { tried[i] = climb_all_levels(agreement, tried[i].scaled); });
  const Candidate best =
      *std::max_element(tried.begin(), tried.end(),
                        [](const Candidate& a, const Candidate& b) { return a.value < b.value; });
  const Vector6 xi = config.std.cwiseProduct(best.scaled);
  Registration result;
  result.T_world_imu = moved(T_world_imu, xi);
  result.covariance = sandwich(agreement, xi, kFinest, config.std);
  result.covariance.diagonal() += config.floor_std.cwiseAbs2();
  result.score = best.value / static_cast<double>(std::max<std::size_t>(1, agreement.patches()));
  result.significance = significance(agreement, xi, kFinest);
  return result;
}

LensSweep sweep_lens(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                     const RigidTransform& found, const RigidTransform& T_imu_cam,
                     const PinholeCamera& camera, const SearchConfig& config) {
  // A lens that is longer by some share shows nearly what a camera nearer by that share of the
  // depth does: a wrong one is answered by a wrong pose, and that has to be taken back with it.
  const double depth_m = median_depth_m(views, T_imu_cam);
  std::array<std::vector<double>, kLenses.size()> agreements;  // of the pieces of the scene
  parallel_for(kLenses.size(), config.threads, [&](std::size_t i) {
    PinholeCamera other = camera;
    other.fx_px *= kLenses[i].focal;
    other.fy_px *= kLenses[i].focal;
    const Agreement agreement(views, T_world_imu, T_imu_cam, other, config, kLenses[i].radial);
    RigidTransform start = found;
    start.p -= (kLenses[i].focal - 1.0) * depth_m * (found.R * T_imu_cam.R.col(2));
    const Candidate best =
        climb_all_levels(agreement, motion_between(T_world_imu, start).cwiseQuotient(config.std));
    agreements[i] = of_pieces(agreement, config.std.cwiseProduct(best.scaled), kFinest);
  });
  LensSweep sweep;
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    for (std::size_t k = 0; k < agreements[i].size(); ++k) {
      const double lead = agreements[i][k] - agreements.front()[k];
      sweep[i].agreement += agreements[i][k];
      sweep[i].scatter += lead * lead;
    }
  }
  return sweep;
}

BestLens best_lens(const LensSweep& sweep) {
  const LensFit& own = sweep.front();
  const auto* const best = std::max_element(
      sweep.begin(), sweep.end(),
      [](const LensFit& a, const LensFit& b) { return a.agreement < b.agreement; });
  if (!(own.agreement > 0.0) || best == &own) {
    return {};  // nothing agrees with anything, or no lens better than the calibration's
  }
  return {kLenses[static_cast<std::size_t>(best - sweep.begin())], best->agreement / own.agreement,
          (best->agreement - own.agreement) / std::sqrt(best->scatter)};
}

}  // namespace topoloc::refinement
