// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/route.hpp"
#include "topoloc/world/world.hpp"

#include <array>
#include <vector>

namespace topoloc::world {

constexpr int kSlots = 3;            ///< lanes a side at most
constexpr double kFootway_m = 2.5;   ///< also the radius of kerbs at side streets
constexpr double kLaneOpen_m = 3.0;  ///< a lane narrower than this is just opening or ending

/// The road across, at one place: smooth functions of the way. Slot 0 is the outermost lane.
struct Profile {
  std::array<double, kSlots> right_m{};  ///< widths of the lanes driven
  std::array<double, kSlots> left_m{};   ///< of the oncoming ones
  double median_half_m = 0.0;
  double inner_m = 0.0;
  double outer_m = 0.0;
  double parking_m = 0.0;
  double footway_m = 0.0;
  double kerb_m = 0.0;

  /// Offset of a lane's middle [m, positive to the left].
  [[nodiscard]] double lane_middle(bool right, int slot) const;
  /// Distance of the carriageway's edge from the route's line, parked cars included.
  [[nodiscard]] double edge(bool right) const;
  /// Distance of the outermost lane's outer edge.
  [[nodiscard]] double lanes_edge(bool right) const;
};

std::vector<Section> make_sections(const WorldSpec& spec, const Route& route);
const Section& section_at(const std::vector<Section>& sections, double along_m);
/// Of the traffic in a lane: faster towards the middle, where there is more than one.
double lane_speed_mps(const Section& section, bool right, int slot);
Profile profile_at(const std::vector<Section>& sections, double along_m);

}  // namespace topoloc::world
