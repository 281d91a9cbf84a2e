// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/profile.hpp"

#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kBlend_m = 65.0;    // half of where one profile turns into the next, at most
constexpr double kBlendShare = 0.4;  // of the shorter section
constexpr double kHighwayLane_m = 3.6;

Profile profile_of(const Section& section) {
  Profile result;
  for (int slot = 0; slot < kSlots; ++slot) {
    const auto i = static_cast<std::size_t>(slot);
    result.right_m[i] = slot < section.lanes_right ? section.lane_width_m : 0.0;
    result.left_m[i] = slot < section.lanes_left ? section.lane_width_m : 0.0;
  }
  result.median_half_m = section.median_half_m;
  result.inner_m = section.inner_m;
  result.outer_m = section.outer_m;
  result.parking_m = section.parking_m;
  result.footway_m = section.footway_m;
  result.kerb_m = section.kerb_m;
  return result;
}

Profile blend(const Profile& a, const Profile& b, double share) {
  // Quintic: the second derivative, a vehicle's lateral acceleration, begins and ends with 0.
  const double t = share * share * share * (10.0 + share * (6.0 * share - 15.0));
  Profile result;
  for (std::size_t i = 0; i < kSlots; ++i) {
    result.right_m[i] = std::lerp(a.right_m[i], b.right_m[i], t);
    result.left_m[i] = std::lerp(a.left_m[i], b.left_m[i], t);
  }
  result.median_half_m = std::lerp(a.median_half_m, b.median_half_m, t);
  result.inner_m = std::lerp(a.inner_m, b.inner_m, t);
  result.outer_m = std::lerp(a.outer_m, b.outer_m, t);
  result.parking_m = std::lerp(a.parking_m, b.parking_m, t);
  result.footway_m = std::lerp(a.footway_m, b.footway_m, t);
  result.kerb_m = std::lerp(a.kerb_m, b.kerb_m, t);
  return result;
}

void set_town(Section& section) {
  section.parking_m = 2.1;
  section.footway_m = kFootway_m;
  section.kerb_m = 0.12;
  section.limit_mps = 13.9;
}

void set_highway(Section& section, int lanes) {
  section.lanes_right = lanes;
  section.lanes_left = lanes;
  section.lane_width_m = kHighwayLane_m;
  section.median_half_m = 1.6;
  section.inner_m = 0.6;
  section.outer_m = 2.6;
  section.limit_mps = 30.0;
}

void set_country_road(Section& section) {
  section.lane_width_m = kHighwayLane_m;
  section.outer_m = 1.2;
  section.limit_mps = 22.2;
}

void set_tunnel(Section& section, bool two_way) {
  section.lane_width_m = kHighwayLane_m;
  section.outer_m = 0.6;
  section.footway_m = 1.0;
  section.kerb_m = 0.15;
  section.limit_mps = 22.2;
  section.two_way = two_way;
  if (!two_way) {
    section.lanes_right = 2;
    section.lanes_left = 2;
    section.median_half_m = 1.6;
    section.inner_m = 0.6;
  }
}

}  // namespace

double Profile::lane_middle(bool right, int slot) const {
  const std::array<double, kSlots>& widths = right ? right_m : left_m;
  double from_line = median_half_m + inner_m;
  for (int i = kSlots - 1; i > slot; --i) {
    from_line += widths[static_cast<std::size_t>(i)];
  }
  from_line += 0.5 * widths[static_cast<std::size_t>(slot)];
  return right ? -from_line : from_line;
}

double Profile::lanes_edge(bool right) const {
  const std::array<double, kSlots>& widths = right ? right_m : left_m;
  return median_half_m + inner_m + widths[0] + widths[1] + widths[2];
}

double Profile::edge(bool right) const { return lanes_edge(right) + outer_m + parking_m; }

std::vector<Section> make_sections(const WorldSpec& spec, const Route& route) {
  Random random(key(spec.seed, {0x5EC7}));
  const bool two_way = spec.scenario == Scenario::kTunnel && random.chance(0.5);
  const int lanes = spec.scenario == Scenario::kHighway ? 2 + random.below(2) : 2;
  std::vector<Section> result;
  double begin_m = 0.0;
  for (const Stretch& stretch : route.stretches()) {
    if (result.empty() || result.back().setting != stretch.setting) {
      Section section;
      section.setting = stretch.setting;
      section.begin_m = begin_m;
      section.seed = static_cast<std::uint32_t>(random.next());
      if (stretch.setting == Setting::kTown) {
        set_town(section);
      } else if (stretch.setting == Setting::kTunnel) {
        set_tunnel(section, two_way);
      } else if (two_way) {
        set_country_road(section);
      } else {
        set_highway(section, lanes);
      }
      result.push_back(section);
    }
    begin_m += stretch.length_m;
    result.back().end_m = begin_m;
  }
  return result;
}

const Section& section_at(const std::vector<Section>& sections, double along_m) {
  const auto next = std::upper_bound(
      sections.begin(), sections.end(), along_m,
      [](double place, const Section& section) { return place < section.begin_m; });
  return next == sections.begin() ? *next : *(next - 1);
}

double lane_speed_mps(const Section& section, bool right, int slot) {
  constexpr double kPerLane_mps = 4.5;
  const bool first = right && slot == 0;
  return section.limit_mps * (first ? 0.85 : 0.95) + kPerLane_mps * slot;
}

Profile profile_at(const std::vector<Section>& sections, double along_m) {
  const Section& here = section_at(sections, along_m);
  const auto index = static_cast<std::size_t>(&here - sections.data());
  const auto half = [](const Section& a, const Section& b) {
    return std::min(kBlend_m, kBlendShare * std::min(a.end_m - a.begin_m, b.end_m - b.begin_m));
  };
  if (index > 0) {
    const double half_m = half(sections[index - 1], here);
    if (along_m < here.begin_m + half_m) {
      return blend(profile_of(sections[index - 1]), profile_of(here),
                   (along_m - here.begin_m + half_m) / (2.0 * half_m));
    }
  }
  if (index + 1 < sections.size()) {
    const double half_m = half(here, sections[index + 1]);
    if (along_m > here.end_m - half_m) {
      return blend(profile_of(here), profile_of(sections[index + 1]),
                   (along_m - here.end_m + half_m) / (2.0 * half_m));
    }
  }
  return profile_of(here);
}

}  // namespace topoloc::world
