// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/tunnel.hpp"

#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kPanel_m = 1.5;
constexpr double kPanelHigh_m = 1.3;
constexpr double kInnerWall_m = 0.75;  // of a one-way tube, right of the route's line

}  // namespace

Bore bore_at(const Maker& maker, double along_m) {
  const Profile profile = maker.profile(along_m);
  Bore bore;
  bore.right_m = -profile.edge(true) - 1.0;
  const bool tube = profile.median_half_m > 0.5;
  bore.left_m = tube ? -kInnerWall_m : profile.edge(false) + 1.0;
  return bore;
}

void make_tunnel(Maker& maker, const Section& section) {
  MeshBuilder builder = maker.unique();
  Random random(maker.draw(0x70BE, section.seed));
  const auto tone = static_cast<float>(random.uniform(0.5, 0.68));
  const std::vector<double> along = stations(section.begin_m, section.end_m, 1.0);
  for (const bool right : {true, false}) {
    const std::uint32_t wall = builder.surface(
        Material::kTunnelWall, random,
        {static_cast<float>(kPanel_m), static_cast<float>(kPanelHigh_m), tone, 1.05F});
    ribbon(
        builder, maker.route(), along,
        [&](double s) -> std::vector<Across> {
          const Bore bore = bore_at(maker, s);
          const double y = right ? bore.right_m : bore.left_m;
          const double lean = right ? 0.02 : -0.02;  // walls lean out a little
          return {{y, -0.05}, {y - lean, 0.5 * bore.wall_m}, {y, bore.wall_m}};
        },
        wall);
  }
  const std::uint32_t vault = builder.surface(Material::kConcrete, random, {0.0F, 0.24F});
  ribbon(
      builder, maker.route(), along,
      [&](double s) -> std::vector<Across> {
        const Bore bore = bore_at(maker, s);
        return {{bore.right_m, bore.wall_m},
                {bore.right_m + 0.5, bore.wall_m + 0.9},
                {bore.right_m + 1.6, bore.roof_m},
                {bore.left_m - 1.6, bore.roof_m},
                {bore.left_m - 0.5, bore.wall_m + 0.9},
                {bore.left_m, bore.wall_m}};
      },
      vault);
  if (maker.profile(0.5 * (section.begin_m + section.end_m)).median_half_m > 0.5) {
    // Walkway at the inner wall of a tube.
    const std::uint32_t kerb = builder.surface(Material::kConcrete, random, {1.0F, 0.34F});
    ribbon(
        builder, maker.route(), along,
        [&](double s) -> std::vector<Across> {
          const Profile profile = maker.profile(s);
          const double edge = -profile.median_half_m;
          return {{edge, -0.03}, {edge, 0.15}, {edge + 0.14, 0.15}, {-kInnerWall_m, 0.16}};
        },
        kerb);
  }
  make_tunnel_things(maker, section);
  make_portals(maker, section);
}

}  // namespace topoloc::world
