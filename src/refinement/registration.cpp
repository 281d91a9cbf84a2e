// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/registration.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::refinement {

std::string_view name(Route route) { return route == Route::kMatches ? "matches" : "correlation"; }

RigidTransform moved(const RigidTransform& T_world_imu, const Vector6& xi) {
  return T_world_imu * RigidTransform{so3::exp(xi.head<3>()), xi.tail<3>()};
}

Vector6 motion_between(const RigidTransform& T_from, const RigidTransform& T_to) {
  const RigidTransform T = T_from.inverse() * T_to;
  Vector6 xi;
  xi << so3::log(T.R), T.p;
  return xi;
}

}  // namespace topoloc::refinement
