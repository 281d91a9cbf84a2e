// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/world/route.hpp"
#include "topoloc/world/surface.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

/// Offline: a made-up piece of the world to drive in. Never linked into the vehicle process.
namespace topoloc::world {

enum class Scenario : std::uint8_t { kTown, kHighway, kTunnel, kMixed };
std::string_view name(Scenario scenario);
/// Throws std::invalid_argument that lists the names.
Scenario scenario_of(std::string_view name);

/// What a world is made from: the same description gives the same world, bit for bit.
struct WorldSpec {
  Scenario scenario = Scenario::kTown;
  std::uint64_t seed = 1;
  double length_m = 1000.0;  ///< of the road driven
};

/// A mesh put somewhere: a tree, a car.
struct Instance {
  std::uint32_t mesh = 0;  ///< index into World::meshes
  RigidTransform T_world_mesh;
  float scale = 1.0F;
  std::uint32_t seed = 0;
};

/// A lamp that is lit at night, or always (tunnel).
struct Lamp {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< where it shines to
  double intensity = 1.0;  ///< irradiance at 1 m, in units of full day light: 1e5 cd
  double cos_cone = 0.0;   ///< cosine of the half angle that it lights
  bool always_on = false;
};

/// A lane of the road driven, for who drives there.
struct Lane {
  double left_m = 0.0;      ///< of its middle off the route's line; negative: to the right
  bool forward = true;      ///< traffic goes the route's way
  double speed_mps = 13.9;  ///< of its traffic
};

/// A run of stretches with one setting, and the road's profile there; profiles blend where
/// sections meet.
struct Section {
  Setting setting = Setting::kTown;
  double begin_m = 0.0;
  double end_m = 0.0;
  int lanes_right = 1;  ///< the way driven
  int lanes_left = 1;   ///< oncoming
  double lane_width_m = 3.25;
  double median_half_m = 0.0;  ///< of the strip between the directions
  double inner_m = 0.0;        ///< from the median to the first lane
  double outer_m = 0.3;        ///< from the last lane to the kerb or the parked cars; hard shoulder
  double parking_m = 0.0;
  double footway_m = 0.0;
  double kerb_m = 0.0;  ///< height
  bool two_way = true;  ///< false: the other direction has a tunnel of its own
  double limit_mps = 13.9;
  std::uint32_t seed = 0;
};

/// Where a car may park.
struct ParkingPlace {
  RigidTransform T_world_place;  ///< middle of the place on the ground, x as the traffic beside it
  double length_m = 6.0;
};

struct World {
  WorldSpec spec;
  Route route{{{Setting::kTown, 1.0, 0.0, 0.0}}};
  std::vector<Surface> surfaces;
  std::vector<Mesh>
      meshes;  ///< [0]: all that is fixed and unique, in the world's frame; then prototypes
  std::vector<Instance> instances;  ///< fixed: trees, lamp posts
  std::vector<Lamp> lamps;
  std::vector<Section> sections;  ///< from the route's begin to its end
  std::vector<ParkingPlace> parking;
  /// Of prototypes for traffic, the last two a lorry and a bus; none, or seven or more. Frame:
  /// middle of the rear axle on the ground, x forward, y left, z up.
  std::vector<std::uint32_t> car_meshes;

  /// The lanes at a way along the route, right to left; the first one is driven by the ego vehicle
  /// unless it says otherwise.
  [[nodiscard]] std::vector<Lane> lanes(double along_m) const;
  /// What a careful driver drives there without traffic.
  [[nodiscard]] double speed_limit_mps(double along_m) const;
  /// Height of the road's surface above the route's line: bumps, dips, patches; centimetres.
  [[nodiscard]] double bump_m(double along_m, double left_m) const;
};

World make_world(const WorldSpec& spec);

/// What differs between two drives through one world.
struct VisitSpec {
  std::uint64_t seed = 1;
  double parked_share = 0.5;     ///< of the places along kerbs that are taken
  double traffic_per_km = 12.0;  ///< moving vehicles on a road of one lane each way; more lanes
                                 ///< carry more
};

/// Cars, parked and moving, during one drive.
class Visit {
 public:
  /// Throws std::invalid_argument for one to six models of cars.
  Visit(const World& world, const VisitSpec& spec);

  [[nodiscard]] const std::vector<Instance>& parked() const { return parked_; }
  /// Vehicles that are on the road `time_s` after the drive's begin, when the ego vehicle is at
  /// `ego_along_m` of the route in the lane `ego_left_m`: none of them is in its way; some drive
  /// ahead.
  [[nodiscard]] std::vector<Instance> moving(double time_s, double ego_along_m,
                                             double ego_left_m) const;

 private:
  const World* world_;
  VisitSpec spec_;
  std::vector<Instance> parked_;
  /// Time that a lane's traffic takes from the route's begin to places along it, by lane.
  std::vector<std::vector<double>> travel_s_;
};

}  // namespace topoloc::world
