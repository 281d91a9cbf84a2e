// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/map/feature_record.hpp"

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace topoloc::map {

/// What is wrong with a map file or with what should go into one; the message names the file.
class MapError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The feature extractor whose descriptors a map holds: only the same one can be matched with it.
struct ModelIdentity {
  std::string name;               ///< as in the configuration, such as "xfeat"
  std::uint64_t fingerprint = 0;  ///< XXH3-64 of the model file
  int descriptor_dim = 0;

  bool operator==(const ModelIdentity&) const = default;
};

/// "xfeat (64-d, fingerprint 0123456789abcdef)", for messages.
std::string to_string(const ModelIdentity& model);

/// What holds for the whole map.
struct MapInfo {
  PinholeCamera camera;      ///< undistorted camera of all features and images
  RigidTransform T_imu_cam;  ///< extrinsics of the vehicle that mapped, not of the one that drives
  ModelIdentity model;
  /// World coordinates are coordinates of `crs` minus this [m]: keeps them small and exact.
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  std::string crs;      ///< coordinate reference system, such as "EPSG:32632"; empty: local
  std::string creator;  ///< program and version that made the map
};

/// Figures that tell a good node from a bad one; MapWriter takes them from the features.
struct NodeQuality {
  std::uint32_t feature_count = 0;
  std::uint32_t lifted_count = 0;
  float mean_depth_std_m = 0.0F;  ///< over the lifted features; 0 without any

  [[nodiscard]] float lifted_share() const {
    return feature_count == 0
               ? 0.0F
               : static_cast<float>(lifted_count) / static_cast<float>(feature_count);
  }
  bool operator==(const NodeQuality&) const = default;
};

/// A node as a builder hands it to MapWriter.
struct NodeDraft {
  std::int64_t time_ns = 0;    ///< mid-exposure of its camera image, Unix
  RigidTransform T_world_cam;  ///< camera (x right, y down, z forward) to world
  /// Covariance of the pose error (theta [rad], p [m]): R_true = R Exp(theta) in the node's camera
  /// axes, p_true = p + dp in world axes (as estimation::MatchedNode).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<Feature> features;
  std::vector<std::int8_t> descriptors;  ///< features x descriptor_dim, see encode_descriptors()
  std::vector<std::byte> camera_image;  ///< JPEG or PNG of the undistorted grey image; may be empty
  std::vector<std::byte> depth_image;   ///< from encode_depth(); may be empty
  std::vector<std::byte> intensity_image;  ///< from encode_intensity(); may be empty
};

/// Largest numbers that the file format takes; beyond them a file is refused as damaged.
inline constexpr std::size_t kMaxNodes = std::size_t{1} << 24;
inline constexpr std::size_t kMaxFeaturesPerNode = 16384;
inline constexpr int kMaxDescriptorDim = 1024;
/// Features are stored in 1/32 px in 16 bits.
inline constexpr int kMaxImageSide_px = 2048;
inline constexpr std::size_t kMaxReportSize = std::size_t{1} << 30;  ///< bytes of a build report

}  // namespace topoloc::map
