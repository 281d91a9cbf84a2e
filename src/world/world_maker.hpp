// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/random.hpp"
#include "topoloc/world/world.hpp"

#include "world/mesh_builder.hpp"
#include "world/profile.hpp"
#include "world/ribbon.hpp"
#include "world/site.hpp"

#include <cstdint>
#include <span>
#include <vector>

/// How make_world() is split up: each part of the world appends to the world that is being made.
namespace topoloc::world {

constexpr double kBehind_m = 60.0;   ///< scenery before the route's begin
constexpr double kBeyond_m = 260.0;  ///< and after its end

/// Meshes that are put in many places.
struct Prototypes {
  std::vector<std::uint32_t> trees;   ///< near the road
  std::vector<std::uint32_t> woods;   ///< trees of few triangles, for the distance
  std::vector<std::uint32_t> bushes;  ///< 1 to 2 m
  std::vector<std::uint32_t> tufts;   ///< grass and herbs on verges
  std::uint32_t litter = 0;           ///< fallen leaves
  std::uint32_t hedge = 0;            ///< 2 m of it, 1 m high
  std::uint32_t street_lamp = 0;      ///< arm along +y
  std::uint32_t highway_lamp = 0;
  std::uint32_t traffic_light = 0;
  std::uint32_t bollard = 0;
  std::uint32_t delineator = 0;
  std::uint32_t bin = 0;
  std::uint32_t bench = 0;
  std::uint32_t cabinet = 0;
  std::uint32_t bicycle_stand = 0;
};

/// A side street that leaves the road on one side.
struct SideStreet {
  double along_m = 0.0;  ///< its middle
  bool right = true;
  double length_m = 50.0;
  double slope = 0.0;
  std::uint32_t seed = 0;
};
constexpr double kSideHalf_m = 3.0;                          ///< of its carriageway
constexpr double kOpeningHalf_m = kSideHalf_m + kFootway_m;  ///< gap in the road's footway

struct Maker {
  World& world;
  Prototypes prototypes;
  Site site;
  std::vector<SideStreet> side_streets;
  std::vector<double> crossings;  ///< middles of zebra crossings

  explicit Maker(World& made);

  /// Builder of the unique mesh, world's frame.
  [[nodiscard]] MeshBuilder unique() { return {world.meshes[0], world.surfaces}; }
  /// Adds a mesh and returns a builder of it; the builder ends with the next call.
  MeshBuilder prototype(std::uint32_t& index);
  [[nodiscard]] std::uint64_t draw(std::uint64_t what, std::uint64_t which = 0) const {
    return key(world.spec.seed, {what, which});
  }
  [[nodiscard]] Profile profile(double along_m) const {
    return profile_at(world.sections, along_m);
  }
  [[nodiscard]] Frames route() const {
    return [this](double along_m) { return world.route.T_world_road(along_m); };
  }
  /// Whether kerb and footway of a side go on at a place: no side street there.
  [[nodiscard]] bool open(double along_m, bool right, double margin_m = 0.0) const;
  [[nodiscard]] double first_m() const { return -kBehind_m; }
  [[nodiscard]] double last_m() const { return world.route.length_m() + kBeyond_m; }
  /// Bounds of a section's scenery: the first and the last go on beyond the route's ends.
  [[nodiscard]] double begin_m(const Section& section) const;
  [[nodiscard]] double end_m(const Section& section) const;
  /// Frame that stands upright at a place of the route: x along, z the world's.
  [[nodiscard]] RigidTransform upright(double along_m, double left_m, double up_m = 0.0) const;
  void put(std::uint32_t mesh, const RigidTransform& T_world_mesh, std::uint64_t seed,
           double scale = 1.0);
  /// The same with a look and a size as they happen.
  void put(std::uint32_t mesh, const RigidTransform& T_world_mesh, Random& random, double min_scale,
           double max_scale);
  /// Any of some meshes, turned as it happens.
  void put_any(std::span<const std::uint32_t> meshes, const Point& position, Random& random,
               double min_scale, double max_scale);
};

/// Frame of a side street: x away from the road from its kerb, z up off the street.
RigidTransform side_frame(const World& world, const SideStreet& street);

RigidTransform upright_at(const Point& position, double heading_rad);

// In this order: later parts keep clear of what earlier ones claimed on the site.
void make_prototypes(Maker& maker);
void make_cars(Maker& maker);
void plan_town(Maker& maker, const Section& section);  ///< side streets, crossings
void make_road(Maker& maker);
void make_markings(Maker& maker);
void make_side_streets(Maker& maker);
void make_town(Maker& maker, const Section& section);
void make_highway(Maker& maker, const Section& section);
void make_tunnel(Maker& maker, const Section& section);
void make_terrain(Maker& maker);

}  // namespace topoloc::world
