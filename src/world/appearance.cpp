// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <algorithm>

namespace topoloc::world {
namespace {

Appearance pattern(Material material, const patterns::Spot& spot) {
  switch (material) {
    case Material::kAsphalt:
      return patterns::asphalt(spot);
    case Material::kRoadMarking:
      return patterns::road_marking(spot);
    case Material::kPavement:
      return patterns::pavement(spot);
    case Material::kGrass:
      return patterns::grass(spot);
    case Material::kFoliage:
      return patterns::foliage(spot);
    case Material::kBark:
      return patterns::bark(spot);
    case Material::kFacade:
      return patterns::facade(spot);
    case Material::kShopFront:
      return patterns::shop_front(spot);
    case Material::kRoof:
      return patterns::roof(spot);
    case Material::kSign:
      return patterns::sign(spot);
    case Material::kPole:
      return patterns::pole(spot);
    case Material::kCarBody:
      return patterns::car_body(spot);
    case Material::kCarGlass:
      return patterns::car_glass(spot);
    case Material::kTyre:
      return patterns::tyre(spot);
    case Material::kTunnelWall:
      return patterns::tunnel_wall(spot);
    case Material::kConcrete:
      return patterns::concrete(spot);
    case Material::kGuardRail:
      return patterns::guard_rail(spot);
    case Material::kLamp:
      return patterns::lamp(spot);
    case Material::kDoor:
      return patterns::door(spot);
    case Material::kWindow:
      return patterns::window(spot);
    case Material::kFence:
      return patterns::fence(spot);
    case Material::kGround:
      return patterns::ground(spot);
    case Material::kPlate:
      return patterns::plate(spot);
  }
  return {};
}

}  // namespace

Appearance appearance(const Surface& surface, std::uint32_t instance, const Eigen::Vector2f& uv_m,
                      float footprint_m) {
  constexpr float kFinest_m = 1e-4F;
  const patterns::Spot spot{uv_m.x(),     uv_m.y(), std::max(footprint_m, kFinest_m),
                            surface.seed, instance, surface.parameters};
  Appearance result = pattern(surface.material, spot);
  result.albedo = noise::clamp01(result.albedo);
  result.nir = noise::clamp01(result.nir);
  result.retro = noise::clamp01(result.retro);
  result.gloss = noise::clamp01(result.gloss);
  return result;
}

}  // namespace topoloc::world
