// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/refinement/registration.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace topoloc::refinement {

/// Chooses among registrations of neighbouring keyframes, of either route: the surest (a window
/// before a view, then the smallest determinant of the covariance) and all that agree with it
/// statistically (99 % of chi square, six degrees of freedom), given the motion between `poses`
/// (T_world_imu by keyframe). Indices, ascending; the first of equally sure ones leads.
std::vector<std::size_t> agreeing_with_the_surest(std::span<const Registration> registrations,
                                                  std::span<const RigidTransform> poses);

/// Sets `shared_by` of what was chosen for a stretch of so many metres: neighbours look at the same
/// piece of the cloud, and its errors last for `correlation_m`.
void share_errors(std::span<Registration> chosen, double stretch_m, double correlation_m);

}  // namespace topoloc::refinement
