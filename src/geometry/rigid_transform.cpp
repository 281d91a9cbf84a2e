// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/rigid_transform.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc {

RigidTransform interpolate(const RigidTransform& T0, const RigidTransform& T1, double fraction) {
  const Eigen::Vector3d phi = so3::log(T0.R.transpose() * T1.R);
  return {T0.R * so3::exp(fraction * phi), T0.p + fraction * (T1.p - T0.p)};
}

}  // namespace topoloc
