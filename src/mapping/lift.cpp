// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/lift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

namespace topoloc::mapping {
namespace {

/// A visible point near the pixel.
struct Neighbour {
  Eigen::Vector2d offset_px;  // from the pixel to lift
  double inverse_depth;       // [1/m]
  bool on_surface = true;
};

std::vector<Neighbour> gather(const RenderedView& view, const Eigen::Vector2d& pixel_px,
                              double radius_px) {
  std::vector<Neighbour> neighbours;
  const auto clamp_to = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size - 1)));
  };
  // A point may lie half a pixel off the pixel it is stored at.
  const double reach_px = radius_px + 0.5;
  const int u_end = clamp_to(std::ceil(pixel_px.x() + reach_px), view.camera.width_px);
  const int v_end = clamp_to(std::ceil(pixel_px.y() + reach_px), view.camera.height_px);
  for (int v = clamp_to(pixel_px.y() - reach_px, view.camera.height_px); v <= v_end; ++v) {
    for (int u = clamp_to(pixel_px.x() - reach_px, view.camera.width_px); u <= u_end; ++u) {
      if (view.is_hole(u, v)) {
        continue;
      }
      const std::size_t at = view.index(u, v);
      const Eigen::Vector2d offset_px = view.pixel_px[at].cast<double>() - pixel_px;
      if (offset_px.squaredNorm() <= radius_px * radius_px) {
        neighbours.push_back({offset_px, 1.0 / static_cast<double>(view.depth_m[at])});
      }
    }
  }
  return neighbours;
}

/// True if the points on the surface surround the pixel: no half-plane without one.
bool surrounded(const std::vector<Neighbour>& neighbours) {
  std::vector<double> angles;
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.on_surface) {
      angles.push_back(std::atan2(neighbour.offset_px.y(), neighbour.offset_px.x()));
    }
  }
  if (angles.size() < 3) {
    return false;
  }
  std::sort(angles.begin(), angles.end());
  double largest_gap = angles.front() + 2.0 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) {
    largest_gap = std::max(largest_gap, angles[i] - angles[i - 1]);
  }
  return largest_gap < std::numbers::pi;
}

/// inverse depth = w(0), w(1) and w(2) its change per pixel right and down.
using Plane = Eigen::Vector3d;

/// Least squares over the points on the surface; nothing if they lie on a line.
std::optional<Plane> fit_plane(const std::vector<Neighbour>& neighbours) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.on_surface) {
      const Eigen::Vector3d row(1.0, neighbour.offset_px.x(), neighbour.offset_px.y());
      normal += row * row.transpose();
      right += row * neighbour.inverse_depth;
    }
  }
  const double count = normal(0, 0);
  if (count < 3.0) {
    return std::nullopt;
  }
  // Scatter of the points in the image: its smaller eigenvalue is their spread across the line.
  const Eigen::Vector2d mean = normal.block<2, 1>(1, 0) / count;
  const Eigen::Matrix2d scatter = normal.block<2, 2>(1, 1) / count - mean * mean.transpose();
  const double half_trace = 0.5 * scatter.trace();
  const double spread_px2 =
      half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - scatter.determinant()));
  constexpr double kMinSpread_px = 0.4;
  if (spread_px2 < kMinSpread_px * kMinSpread_px) {
    return std::nullopt;
  }
  return normal.ldlt().solve(right);
}

/// The same plane in space, n . q = 1: 1/Z = w(0) + w(1) (u - u0) + w(2) (v - v0), times Z, with
/// u Z = fx X + cx Z and v Z = fy Y + cy Z.
Eigen::Vector3d plane_in_space(const Plane& w, const PinholeCamera& camera,
                               const Eigen::Vector2d& pixel_px) {
  return {w(1) * camera.fx_px, w(2) * camera.fy_px,
          w(0) + w(1) * (camera.cx_px - pixel_px.x()) + w(2) * (camera.cy_px - pixel_px.y())};
}

double residual(const Plane& plane, const Neighbour& neighbour) {
  return neighbour.inverse_depth - plane(0) - plane.tail<2>().dot(neighbour.offset_px);
}

double root_mean_square_residual(const Plane& plane, const std::vector<Neighbour>& neighbours) {
  double sum = 0.0;
  int count = 0;
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.on_surface) {
      const double r = residual(plane, neighbour);
      sum += r * r;
      ++count;
    }
  }
  return std::sqrt(sum / std::max(1, count - 3));
}

/// Tolerance around a plane, in inverse depth at that inverse depth: dw = dz w^2.
double tolerance(const LiftConfig& config, double inverse_depth) {
  const double depth_m = 1.0 / inverse_depth;
  return (config.surface_tolerance_m + config.surface_tolerance * depth_m) * inverse_depth *
         inverse_depth;
}

Lift judged(const LiftConfig& config, double depth_m, double depth_std_m) {
  if (!(depth_std_m <= config.max_relative_std * depth_m)) {
    return {LiftVerdict::kUncertain};
  }
  return {LiftVerdict::kLifted, depth_m, depth_std_m, Eigen::Vector3d::Zero()};
}

/// Too few points for a plane, or all on one scan line: the touching ones speak for the pixel. The
/// slope is unknown, so three percent of the depth is the least one can claim.
Lift lift_by_touch(const std::vector<Neighbour>& neighbours, const LiftConfig& config) {
  constexpr double kStdOfUnknownSlope = 0.03;
  double sum = 0.0;
  double least = 0.0;
  double most = 0.0;
  int count = 0;
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.offset_px.norm() <= config.touch_radius_px) {
      least = count == 0 ? neighbour.inverse_depth : std::min(least, neighbour.inverse_depth);
      most = std::max(most, neighbour.inverse_depth);
      sum += neighbour.inverse_depth;
      ++count;
    }
  }
  if (count == 0) {
    return {neighbours.empty() ? LiftVerdict::kNoPoints : LiftVerdict::kExtrapolated};
  }
  const double inverse_depth = sum / count;
  if (most - least > 2.0 * tolerance(config, inverse_depth)) {
    return {LiftVerdict::kDepthEdge};
  }
  const double depth_m = 1.0 / inverse_depth;
  return judged(config, depth_m, std::hypot(config.cloud_std_m, kStdOfUnknownSlope * depth_m));
}

}  // namespace

Lift lift(const RenderedView& view, const Eigen::Vector2d& pixel_px, const LiftConfig& config) {
  std::vector<Neighbour> neighbours;
  for (double radius_px = config.min_radius_px; radius_px <= config.max_radius_px;
       radius_px *= 1.5) {
    neighbours = gather(view, pixel_px, radius_px);
    if (static_cast<int>(neighbours.size()) >= config.min_points && surrounded(neighbours)) {
      break;
    }
  }
  auto plane = fit_plane(neighbours);
  if (!plane) {
    return lift_by_touch(neighbours, config);
  }
  // Two rounds: the second without the points that the first showed to be on another surface.
  constexpr int kRounds = 2;
  double touching_off_surface = 0.0;
  double off_surface = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    off_surface = touching_off_surface = 0.0;
    for (Neighbour& neighbour : neighbours) {
      neighbour.on_surface =
          std::abs(residual(*plane, neighbour)) <= tolerance(config, neighbour.inverse_depth);
      if (!neighbour.on_surface) {
        ++off_surface;
        touching_off_surface += neighbour.offset_px.norm() <= config.touch_radius_px ? 1 : 0;
      }
    }
    if (off_surface == 0) {
      break;
    }
    plane = fit_plane(neighbours);
    if (!plane) {
      return {LiftVerdict::kDepthEdge};
    }
  }
  const auto count = static_cast<double>(neighbours.size());
  const auto touching = static_cast<double>(
      std::count_if(neighbours.begin(), neighbours.end(), [&](const Neighbour& neighbour) {
        return neighbour.offset_px.norm() <= config.touch_radius_px;
      }));
  if (touching_off_surface > (1.0 - config.min_surface_share) * touching ||
      off_surface > (1.0 - config.min_surface_share) * count) {
    return {LiftVerdict::kDepthEdge};
  }
  if (touching == 0.0 && !surrounded(neighbours)) {
    return {LiftVerdict::kExtrapolated};
  }
  const double inverse_depth = (*plane)(0);
  if (!(inverse_depth > 0.0)) {
    return {LiftVerdict::kUncertain};
  }
  // The residuals count in full, not divided by the root of their number: what makes a surface
  // rough (bushes, scan poses) is common to neighbouring points and does not average away.
  const double depth_m = 1.0 / inverse_depth;
  const double roughness_m = root_mean_square_residual(*plane, neighbours) * depth_m * depth_m;
  const double slope_m = plane->tail<2>().norm() * config.pixel_std_px * depth_m * depth_m;
  Lift lifted =
      judged(config, depth_m, std::hypot(std::hypot(config.cloud_std_m, roughness_m), slope_m));
  if (lifted.verdict == LiftVerdict::kLifted) {
    lifted.plane_cam = plane_in_space(*plane, view.camera, pixel_px);
  }
  return lifted;
}

}  // namespace topoloc::mapping
