// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/random.hpp"
#include "topoloc/world/world.hpp"

#include "world/traffic.hpp"
#include "world/vehicle_size.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace topoloc::world {

VehicleSize size_of(const Mesh& mesh) {
  VehicleSize size;
  for (const Vertex& vertex : mesh.vertices) {
    size.rear_m = std::min(size.rear_m, static_cast<double>(vertex.position_m.x()));
    size.front_m = std::max(size.front_m, static_cast<double>(vertex.position_m.x()));
    size.half_width_m =
        std::max(size.half_width_m, std::abs(static_cast<double>(vertex.position_m.y())));
  }
  return size;
}

Visit::Visit(const World& world, const VisitSpec& spec)
    : world_(&world), spec_(spec), travel_s_(travel_times(world)) {
  if (world.car_meshes.empty()) {
    return;
  }
  if (world.car_meshes.size() < kCarModels) {
    throw std::invalid_argument("a world has no models of cars or at least seven");
  }
  std::uint64_t index = 0;
  for (const ParkingPlace& place : world.parking) {
    Random random(key(spec.seed, {0x9A26, index++}));
    if (!random.chance(spec.parked_share)) {
      continue;
    }
    // Lorries and buses, the last two, do not park here; vans seldom do.
    const int models = random.chance(0.12) ? 5 : 4;
    const std::uint32_t mesh =
        world.car_meshes[static_cast<std::size_t>(models == 5 ? 4 : random.below(models))];
    const VehicleSize size = size_of(world.meshes[mesh]);
    const double slack_m = std::max(0.0, 0.5 * (place.length_m - size.front_m + size.rear_m) - 0.3);
    const bool turned = random.chance(0.15);
    RigidTransform T_place_car;
    const double heading = random.uniform(-0.035, 0.035) + (turned ? std::numbers::pi : 0.0);
    T_place_car.R = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const double middle_m = 0.5 * (size.front_m + size.rear_m);  // of the car off its axle
    const double left_m = random.uniform(-0.12, 0.12);
    T_place_car.p = Eigen::Vector3d(random.uniform(-slack_m, slack_m), left_m, 0.0) -
                    T_place_car.R.col(0) * middle_m;
    parked_.push_back(
        {mesh, place.T_world_place * T_place_car, 1.0F, static_cast<std::uint32_t>(random.next())});
  }
}

}  // namespace topoloc::world
