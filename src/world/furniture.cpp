// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/furniture.hpp"

#include "world/plants.hpp"

#include <cmath>
#include <numbers>

namespace topoloc::world {
namespace {

void make_plants(Maker& maker, Random& random) {
  std::uint32_t index = 0;
  const TreeForm forms[] = {{8.5, 2.8, 0.32, 0.14, 30, 3000, 0.16, 8, false},
                            {11.5, 3.6, 0.28, 0.19, 38, 4200, 0.18, 8, false},
                            {6.5, 1.9, 0.38, 0.09, 22, 2100, 0.13, 7, false},
                            {13.0, 2.9, 0.25, 0.18, 40, 3600, 0.17, 8, false},
                            {10.5, 2.4, 0.12, 0.15, 44, 3200, 0.16, 7, true}};
  for (const TreeForm& form : forms) {
    MeshBuilder builder = maker.prototype(index);
    add_tree(builder, random, form);
    maker.prototypes.trees.push_back(index);
  }
  const TreeForm far_forms[] = {{12.0, 4.0, 0.2, 0.2, 16, 520, 0.5, 3, false},
                                {15.0, 4.2, 0.18, 0.2, 18, 600, 0.52, 3, false},
                                {16.0, 2.8, 0.08, 0.2, 22, 560, 0.42, 3, true},
                                {9.0, 4.4, 0.1, 0.2, 14, 480, 0.5, 3, false}};
  for (const TreeForm& form : far_forms) {
    MeshBuilder builder = maker.prototype(index);
    add_tree(builder, random, form);
    maker.prototypes.woods.push_back(index);
  }
  for (int i = 0; i < 4; ++i) {
    MeshBuilder builder = maker.prototype(index);
    const double height_m = random.uniform(0.9, 2.0);
    add_bush(builder, random, random.uniform(0.6, 1.3), height_m, 380);
    maker.prototypes.bushes.push_back(index);
  }
  for (int i = 0; i < 4; ++i) {
    MeshBuilder builder = maker.prototype(index);
    const double height_m = random.uniform(0.18, 0.5);
    add_tuft(builder, random, random.uniform(0.3, 0.8), height_m, 70);
    maker.prototypes.tufts.push_back(index);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.litter);
    add_litter(builder, random, 1.3, 90);
  }
  MeshBuilder builder = maker.prototype(maker.prototypes.hedge);
  add_hedge(builder, random, 2.0, 1.15);
}

void add_lamp_post(MeshBuilder& builder, double height_m, double arm_m, double radius_m,
                   double intensity, std::uint32_t seed) {
  const std::uint32_t pole = builder.surface(Material::kPole, seed, {0.34F});
  const Point across(0.24, 0.0, 0.0);
  const Point along(0.0, 0.55, 0.0);
  const std::uint32_t lamp = builder.surface(
      Material::kLamp, seed + 1, {lamp_emission(intensity, across.norm() * along.norm())});
  builder.bar(Point(0.0, 0.0, -0.2), Point(0.0, 0.0, 1.1), 1.7 * radius_m, 1.6 * radius_m, 10,
              pole);
  builder.bar(Point(0.0, 0.0, 1.1), Point(0.0, 0.0, height_m), radius_m, 0.6 * radius_m, 10, pole);
  builder.bar(Point(0.0, 0.0, height_m - 0.02), Point(0.0, arm_m, height_m + 0.25), 0.045, 0.04, 8,
              pole);
  builder.box(Point(-0.14, arm_m - 0.1, height_m + 0.2), Point(0.14, arm_m + 0.6, height_m + 0.33),
              pole);
  builder.quad(Point(-0.12, arm_m - 0.05, height_m + 0.195), across, along, lamp);
}

void make_small_things(Maker& maker) {
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.street_lamp);
    add_lamp_post(builder, kStreetLamp_m, kStreetLampArm_m, 0.07, kStreetLampIntensity, 501);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.highway_lamp);
    add_lamp_post(builder, kHighwayLamp_m, kHighwayLampArm_m, 0.1, kHighwayLampIntensity, 511);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.traffic_light);
    const std::uint32_t pole = builder.surface(Material::kPole, 521, {0.3F});
    const std::uint32_t box = builder.surface(Material::kPole, 522, {0.05F});
    const std::uint32_t lens = builder.surface(Material::kPole, 523, {0.16F});
    builder.bar(Point(0.0, 0.0, -0.2), Point(0.0, 0.0, 3.5), 0.07, 0.06, 10, pole, true);
    builder.box(Point(-0.15, -0.15, 2.45), Point(0.07, 0.15, 3.4), box, true);
    for (const double z : {2.6, 2.9, 3.2}) {
      builder.bar(Point(-0.15, 0.0, z), Point(-0.17, 0.0, z), 0.1, 0.1, 10, lens, true);
      builder.box(Point(-0.32, -0.12, z + 0.09), Point(-0.15, 0.12, z + 0.11), box, true);
    }
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.bollard);
    const std::uint32_t pole = builder.surface(Material::kPole, 531, {0.12F});
    const std::uint32_t ring = builder.surface(Material::kPole, 532, {0.75F});
    builder.bar(Point(0.0, 0.0, -0.1), Point(0.0, 0.0, 0.72), 0.06, 0.06, 8, pole);
    builder.bar(Point(0.0, 0.0, 0.72), Point(0.0, 0.0, 0.84), 0.062, 0.062, 8, ring);
    builder.bar(Point(0.0, 0.0, 0.84), Point(0.0, 0.0, 0.95), 0.06, 0.04, 8, pole, true);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.delineator);
    const std::uint32_t white = builder.surface(Material::kPole, 541, {0.8F});
    const std::uint32_t black = builder.surface(Material::kPole, 542, {0.04F});
    const std::uint32_t eye = builder.surface(Material::kSign, 543, {0.06F, 0.18F, 4.0F, 1.0F});
    builder.box(Point(-0.06, -0.05, -0.1), Point(0.06, 0.05, 0.68), white);
    builder.box(Point(-0.061, -0.051, 0.68), Point(0.061, 0.051, 0.9), black);
    builder.box(Point(-0.06, -0.05, 0.9), Point(0.06, 0.05, 1.02), white);
    builder.quad(Point(-0.066, -0.03, 0.7), Point(0.0, 0.06, 0.0), Point(0.0, 0.0, 0.18), eye);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.bin);
    const std::uint32_t body = builder.surface(Material::kFence, 551, {0.0F, 0.16F});
    const std::uint32_t label = builder.surface(Material::kSign, 552, {0.2F, 0.2F, 1.0F, 0.0F});
    builder.box(Point(-0.28, -0.3, 0.08), Point(0.28, 0.3, 0.98), body, true);
    builder.box(Point(-0.31, -0.34, 0.98), Point(0.31, 0.33, 1.06), body, true);
    builder.quad(Point(-0.1, -0.305, 0.5), Point(0.2, 0.0, 0.0), Point(0.0, 0.0, 0.2), label);
    for (const double x : {-0.24, 0.24}) {
      builder.bar(Point(x - 0.03, 0.25, 0.1), Point(x + 0.03, 0.25, 0.1), 0.1, 0.1, 8, body, true);
    }
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.bench);
    const std::uint32_t wood = builder.surface(Material::kFence, 561, {1.0F, 0.28F});
    const std::uint32_t iron = builder.surface(Material::kPole, 562, {0.08F});
    for (int i = 0; i < 4; ++i) {
      builder.box(Point(-0.9, -0.2 + 0.12 * i, 0.43), Point(0.9, -0.11 + 0.12 * i, 0.46), wood,
                  true);
      builder.box(Point(-0.9, 0.26, 0.55 + 0.11 * i), Point(0.9, 0.29, 0.63 + 0.11 * i), wood,
                  true);
    }
    for (const double x : {-0.75, 0.75}) {
      builder.box(Point(x - 0.04, -0.2, 0.0), Point(x + 0.04, 0.3, 0.43), iron);
      builder.box(Point(x - 0.04, 0.24, 0.43), Point(x + 0.04, 0.3, 0.95), iron);
    }
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.cabinet);
    const std::uint32_t body = builder.surface(Material::kFence, 571, {3.0F, 0.38F});
    builder.box(Point(-0.5, -0.18, 0.0), Point(0.5, 0.18, 1.25), body);
    builder.box(Point(-0.53, -0.21, 1.25), Point(0.53, 0.21, 1.3), body, true);
  }
  {
    MeshBuilder builder = maker.prototype(maker.prototypes.bicycle_stand);
    const std::uint32_t metal = builder.surface(Material::kPole, 581, {0.4F});
    for (int i = 0; i < 4; ++i) {
      const double x = 0.8 * i - 1.2;
      builder.bar(Point(x, -0.3, -0.1), Point(x, -0.3, 0.8), 0.025, 0.025, 6, metal);
      builder.bar(Point(x, 0.3, -0.1), Point(x, 0.3, 0.8), 0.025, 0.025, 6, metal);
      builder.bar(Point(x, -0.3, 0.8), Point(x, 0.3, 0.8), 0.025, 0.025, 6, metal);
    }
  }
}

}  // namespace

void make_prototypes(Maker& maker) {
  Random random(maker.draw(0x9107));
  make_plants(maker, random);
  make_small_things(maker);
}

void add_sign_post(MeshBuilder& builder, Random& random, double height_m, double size_m,
                   SignShape shape) {
  const std::uint32_t pole = builder.surface(Material::kPole, random, {0.36F});
  const auto size = static_cast<float>(size_m);
  const std::uint32_t back = builder.surface(Material::kPole, random, {0.3F});
  builder.bar(Point(0.0, 0.0, -0.2), Point(0.0, 0.0, height_m + 0.1), 0.035, 0.035, 8, pole, true);
  const double half = 0.5 * size_m;
  const Point middle(-0.045, 0.0, height_m - half);
  if (shape == SignShape::kBoard) {
    const std::uint32_t face =
        builder.surface(Material::kSign, random, {size, 0.6F * size, 2.0F, 1.0F});
    builder.quad(middle + Point(0.0, half, -0.3 * size_m), Point(0.0, -size_m, 0.0),
                 Point(0.0, 0.0, 0.6 * size_m), face);
    builder.quad(middle + Point(0.008, half, -0.3 * size_m), Point(0.0, -size_m, 0.0),
                 Point(0.0, 0.0, 0.6 * size_m), back);
    return;
  }
  // uv of the face: 0 to size from its lower left corner, whatever its outline.
  const std::uint32_t face = builder.surface(
      Material::kSign, random, {size, size, shape == SignShape::kRound ? 0.0F : 3.0F, 1.0F});
  const int sides = shape == SignShape::kRound ? 18 : 3;
  for (const double behind : {0.0, 0.008}) {
    const std::uint32_t surface = behind > 0.0 ? back : face;
    const std::uint32_t hub = builder.vertex(middle + Point(behind, 0.0, 0.0), Uv(half, half));
    std::uint32_t before = 0;
    for (int i = 0; i <= sides; ++i) {
      const double angle = std::numbers::pi * (0.5 + 2.0 * i / sides);
      const double y = half * std::cos(angle);
      const double z = half * std::sin(angle);
      const std::uint32_t rim =
          builder.vertex(middle + Point(behind, y, z), Uv(half - y, half + z));
      if (i > 0) {
        builder.face(hub, before, rim, surface);
      }
      before = rim;
    }
  }
}

}  // namespace topoloc::world
