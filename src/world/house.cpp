// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/house.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kBelow_m = 2.5;  // walls go down into sloping ground

WindowStyle window_style(MeshBuilder& builder, Random& random, const HouseForm& form) {
  WindowStyle style;
  style.width_m = random.uniform(0.85, 1.55);
  style.height_m = random.uniform(1.25, std::min(1.75, form.storey_m - 1.15));
  style.sill_m = random.uniform(0.75, 0.95);
  style.recess_m = random.uniform(0.1, 0.24);
  style.layout = random.below(5);
  style.shutters = !form.plain && random.chance(0.3) && style.width_m < 1.25;
  style.lintel = random.chance(0.6);
  style.frame_tone = static_cast<float>(random.chance(0.75) ? random.uniform(0.62, 0.85)
                                                            : random.uniform(0.1, 0.3));
  style.frame_surface = builder.surface(Material::kConcrete, random,
                                        {2.0F, static_cast<float>(random.uniform(0.3, 0.75))});
  style.shutter_surface = builder.surface(Material::kFence, random,
                                          {1.0F, static_cast<float>(random.uniform(0.12, 0.5))});
  return style;
}

// One storey of a wall: `bays` windows between plain piers.
void add_storey(MeshBuilder& builder, Random& random, double width_m, double floor_m,
                double height_m, int bays, const WindowStyle& style, std::uint32_t wall,
                const HouseForm& form, bool front) {
  const double bay_m = width_m / std::max(1, bays);
  const int balcony_every = front && !form.plain && random.chance(0.35) ? 1 + random.below(3) : 0;
  for (int bay = 0; bay < bays; ++bay) {
    const double x = bay * bay_m;
    if (random.chance(front ? 0.04 : 0.3)) {  // walled up, or a stair well
      builder.quad(Point(x, 0.0, floor_m), Point(bay_m, 0.0, 0.0), Point(0.0, 0.0, height_m), wall,
                   Uv(x, floor_m));
      continue;
    }
    const bool balcony = balcony_every > 0 && bay % balcony_every == 0 && floor_m > 2.9;
    WindowStyle here = style;
    if (balcony) {  // a glazed door
      here.sill_m = 0.08;
      here.height_m = std::min(2.15, height_m - 0.35);
    }
    add_window_bay(builder, random, x, floor_m, bay_m, height_m, here, wall);
    if (balcony) {
      add_balcony(builder, random, x + 0.15, floor_m, bay_m - 0.3, style.frame_surface);
    }
  }
}

void add_front(MeshBuilder& builder, Random& random, const HouseForm& form,
               const WindowStyle& style, std::uint32_t wall, std::uint32_t plinth,
               double ground_floor_m) {
  const int bays = std::max(2, static_cast<int>(form.width_m / random.uniform(2.1, 3.1)));
  const double bay_m = form.width_m / bays;
  const double plinth_m = random.uniform(0.25, 0.6);
  builder.box(Point(0.0, -0.05, -kBelow_m), Point(form.width_m, 0.0, form.shop ? 0.08 : plinth_m),
              plinth);
  if (form.shop) {
    add_shop_front(builder, random, form.width_m, ground_floor_m, wall);
  } else {
    const int door = random.below(bays);
    for (int bay = 0; bay < bays; ++bay) {
      if (bay == door) {
        add_door_bay(builder, random, bay * bay_m, bay_m, ground_floor_m, wall,
                     style.frame_surface);
      } else {
        add_window_bay(builder, random, bay * bay_m, 0.0, bay_m, ground_floor_m, style, wall);
      }
    }
  }
  for (int storey = 1; storey < form.storeys; ++storey) {
    const double floor_m = ground_floor_m + (storey - 1) * form.storey_m;
    add_storey(builder, random, form.width_m, floor_m, form.storey_m, bays, style, wall, form,
               true);
    if (!form.plain && random.chance(storey == 1 ? 0.7 : 0.35)) {  // ledge
      const double out = random.uniform(0.05, 0.14);
      builder.box(Point(0.0, -out, floor_m - 0.09), Point(form.width_m, 0.0, floor_m + 0.06),
                  style.frame_surface, true);
    }
  }
}

void add_side_wall(MeshBuilder& builder, Random& random, const HouseForm& form,
                   const WindowStyle& style, std::uint32_t wall, double ground_floor_m) {
  builder.quad(Point(0.0, 0.0, -kBelow_m), Point(form.depth_m, 0.0, 0.0), Point(0.0, 0.0, kBelow_m),
               wall, Uv(0.0, -kBelow_m));
  const int bays = form.detached ? std::max(1, static_cast<int>(form.depth_m / 4.0)) : 0;
  for (int storey = 0; storey < form.storeys; ++storey) {
    const double floor_m = storey == 0 ? 0.0 : ground_floor_m + (storey - 1) * form.storey_m;
    const double height_m = storey == 0 ? ground_floor_m : form.storey_m;
    if (bays == 0) {
      builder.quad(Point(0.0, 0.0, floor_m), Point(form.depth_m, 0.0, 0.0),
                   Point(0.0, 0.0, height_m), wall, Uv(0.0, floor_m));
    } else {
      add_storey(builder, random, form.depth_m, floor_m, height_m, bays, style, wall, form, false);
    }
  }
}

}  // namespace

void add_house(MeshBuilder& builder, Random& random, const HouseForm& form) {
  const double ground_floor_m = form.shop ? random.uniform(3.5, 4.1) : form.storey_m + 0.25;
  const double eave_m = ground_floor_m + (form.storeys - 1) * form.storey_m;
  // 0: plaster, 1: brick, 2: rough cast with stained base, 3: large panels, 4: quarry stone.
  const int kind = random.chance(0.42) ? 0 : 1 + random.below(4);
  const auto tone =
      static_cast<float>(kind == 1 ? random.uniform(0.12, 0.34) : random.uniform(0.25, 0.78));
  const auto height = static_cast<float>(eave_m);
  const std::uint32_t wall =
      builder.surface(Material::kFacade, random, {static_cast<float>(kind), tone, height});
  const std::uint32_t side_wall =
      random.chance(0.5) ? wall
                         : builder.surface(Material::kFacade, random,
                                           {random.chance(0.5) ? 1.0F : 2.0F, 0.8F * tone, height});
  const std::uint32_t plinth = builder.surface(
      Material::kConcrete, random, {3.0F, static_cast<float>(random.uniform(0.14, 0.35))});
  const WindowStyle style = window_style(builder, random, form);
  const RigidTransform outer = builder.frame();

  add_front(builder, random, form, style, wall, plinth, ground_floor_m);
  for (const bool far : {false, true}) {
    RigidTransform side;
    side.R.col(0) = Point(0.0, 1.0, 0.0);
    side.R.col(1) = Point(far ? -1.0 : 1.0, 0.0, 0.0);
    side.p = Point(far ? form.width_m : 0.0, 0.0, 0.0);
    builder.set_frame(outer * side);
    add_side_wall(builder, random, form, style, side_wall, ground_floor_m);
  }
  builder.set_frame(outer);
  builder.quad(Point(0.0, form.depth_m, -kBelow_m), Point(form.width_m, 0.0, 0.0),
               Point(0.0, 0.0, kBelow_m + eave_m), side_wall);
  add_roof(builder, random, form, eave_m, side_wall);
  if (!form.plain || random.chance(0.4)) {  // downpipe
    const double x = random.chance(0.5) ? 0.12 : form.width_m - 0.12;
    const std::uint32_t pipe =
        builder.surface(Material::kPole, random, {static_cast<float>(random.uniform(0.12, 0.4))});
    builder.bar(Point(x, -0.08, -0.3), Point(x, -0.08, eave_m), 0.05, 0.05, 6, pipe);
  }
}

}  // namespace topoloc::world
