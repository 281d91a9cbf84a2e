// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"

#include <optional>

#include <Eigen/Core>

namespace topoloc::refinement {

/// What the inertial sensors say while the wheels stand, on the average: their errors, and gravity.
struct Standing {
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();
};

/// Nothing where they stand for less than half a second in all. Sensors read zero below some speed,
/// and a vehicle nods as it sets off and stops, which on the average looks like a bias: the second
/// beside a motion does not count.
std::optional<Standing> standing(const drive::Drive& drive);

}  // namespace topoloc::refinement
