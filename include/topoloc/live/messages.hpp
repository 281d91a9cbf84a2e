// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/tick.hpp"

#include <topoloc/estimate_t.hpp>
#include <topoloc/geo_pose_t.hpp>
#include <topoloc/pose_t.hpp>

/// What the vehicle process says on LCM. Times are by the system clock.
namespace topoloc::live {

estimate_t to_estimate(const TickOutput& output);
/// Biases and gravity are taken off rotation rate and acceleration.
pose_t to_pose(const TickOutput& output);
/// World coordinates plus the map's origin. The CRS is set once by the caller: it does not change.
void fill_geo_pose(const TickOutput& output, const Eigen::Vector3d& origin_m, geo_pose_t& message);

/// Whether the pose means something.
bool has_pose(const TickOutput& output);

}  // namespace topoloc::live
