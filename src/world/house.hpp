// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/random.hpp"

#include "world/mesh_builder.hpp"

#include <cstdint>

namespace topoloc::world {

struct HouseForm {
  double width_m = 11.0;  ///< along the street
  double depth_m = 10.0;
  int storeys = 3;
  double storey_m = 3.0;
  bool shop = false;      ///< ground floor
  bool detached = false;  ///< its sides are seen
  bool flat_roof = false;
  bool plain = false;  ///< without balconies, shutters and ledges: for side streets
};

/// A house whose front stands on the builder's x axis: x along the street, y away from it, z up;
/// nothing of it comes nearer to the street than y = -1.3 m, below 3.5 m than -0.6 m.
void add_house(MeshBuilder& builder, Random& random, const HouseForm& form);

/// How a wall's windows are laid out; front and sides share it.
struct WindowStyle {
  double width_m = 1.1;
  double height_m = 1.45;
  double sill_m = 0.9;  ///< above the floor
  double recess_m = 0.15;
  int layout = 0;  ///< of bars, see the window's pattern
  bool shutters = false;
  bool lintel = true;
  std::uint32_t frame_surface = 0;  ///< sills, lintels
  std::uint32_t shutter_surface = 0;
  float frame_tone = 0.7F;
};

/// Wall with a rectangular hole, all that belongs to a window in it included: x along the wall,
/// y into the house.
void add_window_bay(MeshBuilder& builder, Random& random, double x_m, double z_m, double width_m,
                    double height_m, const WindowStyle& style, std::uint32_t wall);
/// Shop windows and their door over the whole width; sign board above.
void add_shop_front(MeshBuilder& builder, Random& random, double width_m, double height_m,
                    std::uint32_t wall);
void add_door_bay(MeshBuilder& builder, Random& random, double x_m, double width_m, double height_m,
                  std::uint32_t wall, std::uint32_t frame);
void add_balcony(MeshBuilder& builder, Random& random, double x_m, double z_m, double width_m,
                 std::uint32_t slab);
void add_roof(MeshBuilder& builder, Random& random, const HouseForm& form, double eave_m,
              std::uint32_t wall);

}  // namespace topoloc::world
