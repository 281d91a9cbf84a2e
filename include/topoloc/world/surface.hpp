// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace topoloc::world {

/// What a surface is made of. Each has its own pattern in appearance().
enum class Material : std::uint8_t {
  kAsphalt,
  kRoadMarking,
  kPavement,  ///< slabs of a footway, kerb stones
  kGrass,
  kFoliage,
  kBark,
  kFacade,  ///< plaster or brick with windows, doors, ledges
  kShopFront,
  kRoof,
  kSign,  ///< traffic sign or name plate: retro-reflective, with a glyph of its own
  kPole,
  kCarBody,
  kCarGlass,
  kTyre,
  kTunnelWall,  ///< panels, nearly alike, with joints, stains and few marks
  kConcrete,    ///< noise barriers, bridges, kerbs of a highway
  kGuardRail,
  kLamp,  ///< shines
  kDoor,
  kWindow,  ///< pane with its frame and bars, curtains behind
  kFence,   ///< painted wood or metal: fences, benches, bins, cabinets
  kGround,  ///< earth, gravel, yards
  kPlate,   ///< number plate
};

/// One surface of its own: a facade, a sign, a stretch of road. `seed` makes it unlike its like.
struct Surface {
  Material material = Material::kConcrete;
  std::uint32_t seed = 0;
  /// What the material needs: size [m], storeys, kind of glyph...; see appearance.cpp.
  std::array<float, 4> parameters{};
};

/// `uv_m`: metres along and up (or across) the surface.
struct Vertex {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector2f uv_m = Eigen::Vector2f::Zero();
};

struct Triangle {
  std::array<std::uint32_t, 3> vertices{};
  std::uint32_t surface = 0;  ///< index into World::surfaces
};

/// Triangles in their own frame (for scenery: the world's).
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

/// How a point of a surface looks.
struct Appearance {
  float albedo = 0.5F;     ///< share of visible light that it scatters, 0 to 1
  float nir = 0.5F;        ///< the same at a LiDAR's wavelength: unlike `albedo` for most materials
  float retro = 0.0F;      ///< light thrown back to where it came from, on top; signs: up to 1
  float emission = 0.0F;   ///< light of its own, in units of a white surface in full day light
  float gloss = 0.0F;      ///< share that it mirrors (glass, car bodies, wet road), 0 to 1
  bool always_on = false;  ///< `emission` by day as well
};

/// Gloss of surfaces smooth enough to show an image of what they mirror; in duller ones it blurs.
inline constexpr float kMirrorGloss = 0.08F;

/// Appearance at a place of a surface. Patterns finer than `footprint_m`, the size of what is
/// looked at (a pixel's or a beam's spot on the surface), fade to their mean, so that nothing
/// flickers. `instance`: Instance::seed, which gives cars their colour, for example.
Appearance appearance(const Surface& surface, std::uint32_t instance, const Eigen::Vector2f& uv_m,
                      float footprint_m);

}  // namespace topoloc::world
