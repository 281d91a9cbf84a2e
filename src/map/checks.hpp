// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"

#include "map/zstd_image.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <Eigen/Core>

/// What writer, reader and verify() demand alike. The functions that return a string say what is
/// wrong, or nothing ("").
namespace topoloc::map {

/// World coordinates beyond this are taken as damage; squared, they must not overflow.
inline constexpr double kMaxCoordinate_m = 1e9;

/// Finite and orthonormal to 1e-6 with determinant +1.
bool is_rotation(const Eigen::Matrix3d& R);

/// Finite and within kMaxCoordinate_m.
bool is_position(const Eigen::Vector3d& p_m);

/// Finite, symmetric, positive semi-definite; the tolerances leave room for float rounding.
bool is_covariance(const Eigen::Matrix<double, 6, 6>& covariance);

std::string problem_with(const MapInfo& info);

/// A feature must be finite and lie in the image; `depth_m` 0 or positive.
std::string problem_with(const Feature& feature, const PinholeCamera& camera);
std::string problem_with(const FeatureRecord& record, const PinholeCamera& camera);

/// JPEG or PNG by its first bytes, or empty.
std::string problem_with_camera_image(std::span<const std::byte> image);

/// Image of that kind and of the camera's size by its header, or empty.
std::string problem_with_image(const ZstdImageKind& kind, std::span<const std::byte> image,
                               const PinholeCamera& camera);

/// JSON (and so UTF-8) of at most kMaxReportSize bytes, or empty.
std::string problem_with_report(std::string_view report);

}  // namespace topoloc::map
