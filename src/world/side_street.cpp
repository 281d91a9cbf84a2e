// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/steps.hpp"
#include "world/world_maker.hpp"

#include <cmath>
#include <numbers>

namespace topoloc::world {
namespace {

constexpr double kKerb_m = 0.12;
constexpr int kArc = 8;  // pieces of a rounded kerb

// Where the kerb of the road turns into the side street's: asphalt outside the arc, footway inside.
void make_corner(MeshBuilder& builder, double sign, std::uint32_t asphalt, std::uint32_t kerb,
                 std::uint32_t slabs) {
  const Point corner(0.0, sign * kSideHalf_m, 0.0);
  const Point centre(kFootway_m, sign * kOpeningHalf_m, kKerb_m);
  const Point up(0.0, 0.0, kKerb_m);
  Point before;
  for (int i = 0; i <= kArc; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / kArc;
    const Point on_arc(kFootway_m * (1.0 - std::cos(angle)),
                       sign * (kOpeningHalf_m - kFootway_m * std::sin(angle)), 0.0);
    if (i > 0) {
      builder.triangle(corner, before, on_arc, asphalt);
      builder.quad(before, on_arc - before, up, kerb, Uv(0.4 * i, 0.0));
      const Point inner_a = before + up + 0.06 * (centre - before - up);
      const Point inner_b = on_arc + up + 0.06 * (centre - on_arc - up);
      builder.corners(before + up, on_arc + up, inner_b, inner_a, kerb, Uv(0.4 * i, kKerb_m));
      builder.triangle(inner_a, inner_b, centre, slabs, Uv(0.3 * i, 0.0));
    }
    before = on_arc;
  }
}

void make_street(Maker& maker, const SideStreet& street) {
  MeshBuilder builder = maker.unique();
  const RigidTransform T = side_frame(maker.world, street);
  Random random(key(street.seed, {0x57}));
  const auto age = static_cast<float>(random.uniform(0.3, 1.0));
  const std::uint32_t asphalt =
      builder.surface(Material::kAsphalt, random, {age, 1.0F, 0.0F, 0.07F + 0.09F * age});
  const std::uint32_t kerb = builder.surface(Material::kConcrete, random, {1.0F, 0.36F});
  const std::uint32_t slabs =
      builder.surface(Material::kPavement, random, {static_cast<float>(random.below(3)), 0.34F});
  const std::uint32_t paint = builder.surface(Material::kRoadMarking, random, {0.5F, 0.12F});
  const Frames along = [T](double s) {
    RigidTransform result = T;
    result.p = T * Point(s, 0.0, 0.0);
    return result;
  };
  const std::vector<double> places = stations(0.0, street.length_m, 2.0);
  ribbon(
      builder, along, places,
      [](double) -> std::vector<Across> {
        return {{-kSideHalf_m, 0.0}, {0.0, 0.02}, {kSideHalf_m, 0.0}};
      },
      asphalt, true);
  const std::vector<double> walk = stations(kFootway_m, street.length_m, 2.0);
  for (const double sign : {-1.0, 1.0}) {
    ribbon(
        builder, along, walk,
        [&](double) -> std::vector<Across> {
          return {{sign * kSideHalf_m, -0.03},
                  {sign * kSideHalf_m, kKerb_m},
                  {sign * (kSideHalf_m + 0.14), kKerb_m}};
        },
        kerb);
    ribbon(
        builder, along, walk,
        [&](double) -> std::vector<Across> {
          return {{sign * (kSideHalf_m + 0.14), kKerb_m},
                  {sign * kOpeningHalf_m, kKerb_m},
                  {sign * (kOpeningHalf_m + 0.02), -0.5}};
        },
        slabs);
  }
  builder.set_frame(T);  // ribbons bring their own
  for (const double sign : {-1.0, 1.0}) {
    make_corner(builder, sign, asphalt, kerb, slabs);
  }
  // Give-way line: traffic towards the road keeps right, seen along -x that is the +y half.
  for (const double y : steps(0.25, kSideHalf_m - 0.4, 0.75)) {
    builder.quad(Point(0.55, y, 0.03), Point(0.0, 0.5, 0.0), Point(0.4, 0.0, 0.0), paint,
                 Uv(y, 0.0));
  }
  const Eigen::Vector2d x = T.R.col(0).head<2>();
  const Eigen::Vector2d y = T.R.col(1).head<2>();
  const double half = kOpeningHalf_m + 0.1;
  maker.site.claim(T.p.head<2>() - half * y, street.length_m * x, 2.0 * half * y);
  // A car or two at the kerb, away from the corner.
  for (const double s : steps(12.0, street.length_m - 4.0, 7.0)) {
    RigidTransform place = along(s);
    place.p = T * Point(s, -(kSideHalf_m - 1.05), 0.02);
    if (random.chance(0.6)) {
      maker.world.parking.push_back({place, 6.5});
    }
  }
}

}  // namespace

void make_side_streets(Maker& maker) {
  for (const SideStreet& street : maker.side_streets) {
    make_street(maker, street);
  }
}

}  // namespace topoloc::world
