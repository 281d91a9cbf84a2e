// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Directions above the plane z = 0, as dense as the cosine to z: what comes from them has equal
/// weight in the light that falls on the plane. The same ones always: what is computed with them
/// has steps, but no noise.
inline constexpr int kHemisphereRays = 32;
const std::array<Eigen::Vector3d, kHemisphereRays>& hemisphere();

/// Rotation that takes z to `normal`.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& normal);

}  // namespace topoloc::rendering
