// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/so3.hpp"
#include "topoloc/refinement/pose_graph.hpp"

#include "unit/refinement/textured_street.hpp"

#include <cstddef>
#include <vector>

namespace topoloc::refinement {

/// Three equal deviations [rad], then three equal ones [m].
inline Vector6 both(double std_rad, double std_m) {
  Vector6 std;
  std << Eigen::Vector3d::Constant(std_rad), Eigen::Vector3d::Constant(std_m);
  return std;
}

/// Poses of a vehicle that goes down a street in a slight bend, and exact factors of them.
struct GraphDrive {
  static constexpr double kStep_m = 1.0;
  static constexpr double kStep_s = 0.25;
  static constexpr double kTurn_rad = 0.004;  ///< a step

  explicit GraphDrive(std::size_t keyframes) {
    RigidTransform pose = TexturedStreet::vehicle_at(0.0);
    const RigidTransform step{so3::exp({0.0, 0.0, kTurn_rad}), {kStep_m, 0.0, 0.0}};
    for (std::size_t k = 0; k < keyframes; ++k, pose = pose * step) {
      truth.push_back(pose);
    }
  }

  [[nodiscard]] PoseGraph with_odometry(const Vector6& std = both(0.0005, 0.005)) const {
    PoseGraph graph;
    for (std::size_t k = 1; k < truth.size(); ++k) {
      graph.odometry.push_back({k - 1, k, truth[k - 1].inverse() * truth[k], kStep_s, std});
    }
    return graph;
  }

  [[nodiscard]] Registration registration(std::size_t keyframe, double std_rad,
                                          double std_m) const {
    Registration result;
    result.keyframe = keyframe;
    result.T_world_imu = truth[keyframe];
    result.covariance = both(std_rad, std_m).cwiseAbs2().asDiagonal();
    result.significance = 10.0;
    return result;
  }

  [[nodiscard]] GroundFactor ground(std::size_t keyframe) const {
    return {keyframe, {truth[keyframe].p.head<2>(), 0.0, Eigen::Vector2d::Zero()}, 0.03};
  }

  /// Points of the street's ground and walls (not its end), from so many keyframes back.
  [[nodiscard]] std::vector<TrackFactor> tracks(const std::vector<std::size_t>& back) const {
    const TexturedStreet street(1);
    const PinholeCamera camera = TexturedStreet::camera();
    std::vector<TrackFactor> factors;
    for (std::size_t to = 0; to < truth.size(); ++to) {
      for (const std::size_t by : back) {
        if (to < by) {
          continue;
        }
        TrackFactor factor{to - by, to, {}, 0};
        const RigidTransform T_world_from = truth[to - by] * TexturedStreet::T_imu_cam();
        const RigidTransform T_world_to = truth[to] * TexturedStreet::T_imu_cam();
        for (double v = 15.0; v < camera.height_px; v += 30.0) {
          for (double u = 15.0; u < camera.width_px; u += 30.0) {
            const auto p = street.meet_ray(T_world_from.p, T_world_from.R * camera.ray({u, v}));
            if (!p) {
              continue;
            }
            const Eigen::Vector4d plane = TexturedStreet::plane_at(*p);
            const Eigen::Vector3d q_to = T_world_to.inverse() * *p;
            constexpr double kNearest_m = 1.0;
            if (plane.x() == 0.0 && q_to.z() > kNearest_m &&
                camera.contains(camera.project(q_to))) {
              const double depth_m = (T_world_from.inverse() * *p).z();
              factor.tracks.push_back(
                  {{Eigen::Vector2d(u, v), depth_m, 0.03, plane}, camera.project(q_to), 1.0});
            }
          }
        }
        factors.push_back(std::move(factor));
      }
    }
    return factors;
  }

  std::vector<RigidTransform> truth;
};

}  // namespace topoloc::refinement
