// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <cmath>
#include <sstream>
#include <string>

#include <CLI/CLI.hpp>

namespace topoloc::apps {

/// T_world_imu of the text "x y z qx qy qz qw"; CLI::ValidationError where it is none.
inline RigidTransform parse_initial_pose(const std::string& text) {
  std::istringstream in(text);
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
  std::string rest;
  const bool read =
      static_cast<bool>(in >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w());
  if (!read || (in >> rest) || !p.allFinite() || !q.coeffs().allFinite() ||
      std::abs(q.norm() - 1.0) > 0.01) {
    throw CLI::ValidationError("--initial-pose",
                               "expected \"x y z qx qy qz qw\" with a unit "
                               "quaternion, found \"" +
                                   text + "\"");
  }
  return RigidTransform::from_quaternion(p, q);
}

}  // namespace topoloc::apps
