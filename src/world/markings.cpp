// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/bump.hpp"
#include "world/steps.hpp"
#include "world/world_maker.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace topoloc::world {
namespace {

constexpr double kLine_m = 0.006;  // paint above the road's mesh: no ray mistakes one for the other
constexpr double kBar_m = 0.014;   // for what is laid across, where the mesh is coarser

struct Painter {
  Maker& maker;
  MeshBuilder builder;
  std::uint32_t surface;

  // A line of paint along the road; offset of its middle as a function of the way.
  void line(double begin_m, double end_m, double width_m,
            const std::function<double(double)>& left_m) {
    if (end_m - begin_m < 0.05) {
      return;
    }
    ribbon(
        builder, maker.route(), stations(begin_m, end_m, kStation_m),
        [&](double s) -> std::vector<Across> {
          const double left = left_m(s);
          const double up = mesh_bump(maker.world, s, left) + kLine_m;
          return {{left - 0.5 * width_m, up}, {left + 0.5 * width_m, up}};
        },
        surface);
  }

  // A patch across the road.
  void bar(double begin_m, double end_m, double from_left_m, double to_left_m) {
    ribbon(
        builder, maker.route(),
        stations(std::min(begin_m, end_m), std::max(begin_m, end_m), kStation_m),
        [&](double s) -> std::vector<Across> {
          return {{from_left_m, mesh_bump(maker.world, s, from_left_m) + kBar_m},
                  {to_left_m, mesh_bump(maker.world, s, to_left_m) + kBar_m}};
        },
        surface, true);
  }
};

struct Dashes {
  double on_m;
  double period_m;
};

// What separates two lanes of one direction, or the directions of a road without median.
Dashes dashes_of(Setting setting) {
  switch (setting) {
    case Setting::kTown:
      return {3.0, 9.0};
    case Setting::kHighway:
      return {6.0, 18.0};
    case Setting::kTunnel:
      return {3.0, 6.0};
  }
  return {};
}

// Lines that are there all along (on_m == period_m) or dashed, on the pieces where `wanted`.
void paint_line(Painter& painter, double width_m, const std::function<bool(double)>& wanted,
                const std::function<Dashes(double)>& dashes,
                const std::function<double(double)>& left_m) {
  constexpr double kPiece_m = 9.0;  // also where paint of another age may begin
  const double last_m = painter.maker.last_m();
  double s = painter.maker.first_m();
  while (s < last_m) {
    const Dashes here = dashes(s);
    const double next_m = s + (here.on_m < here.period_m ? here.period_m : kPiece_m);
    const double end_m = std::min(last_m, here.on_m < here.period_m ? s + here.on_m : next_m);
    if (wanted(s) && wanted(end_m)) {
      painter.line(s, end_m, width_m, left_m);
    }
    s = next_m;
  }
}

bool near_opening(const Maker& maker, double s, bool right) { return !maker.open(s, right, -1.0); }

void paint_lanes(Painter& painter) {
  Maker& maker = painter.maker;
  const auto setting = [&](double s) { return section_at(maker.world.sections, s).setting; };
  const auto crossing_near = [&](double s) {
    for (const double crossing : maker.crossings) {
      if (std::abs(s - crossing) < 4.0) {
        return true;
      }
    }
    return false;
  };
  // Middle of roads without a median.
  paint_line(
      painter, 0.12,
      [&](double s) { return maker.profile(s).median_half_m < 0.02 && !crossing_near(s); },
      [&](double s) {
        const bool solid = std::abs(maker.world.route.curvature_1pm(s)) > 0.012;
        return solid ? Dashes{1.0, 1.0} : dashes_of(setting(s));
      },
      [](double) { return 0.0; });
  for (const bool right : {true, false}) {
    const double sign = right ? -1.0 : 1.0;
    const auto widths = [&, right](double s) {
      const Profile profile = maker.profile(s);
      return right ? profile.right_m : profile.left_m;
    };
    // Between lanes of one direction.
    for (int slot = 0; slot + 1 < kSlots; ++slot) {
      paint_line(
          painter, 0.15,
          [&](double s) {
            return widths(s)[static_cast<std::size_t>(slot) + 1] > 1.0 &&
                   widths(s)[static_cast<std::size_t>(slot)] > 1.0;
          },
          [&](double s) { return dashes_of(setting(s)); },
          [&](double s) {
            const Profile profile = maker.profile(s);
            return profile.lane_middle(right, slot) -
                   sign * 0.5 * widths(s)[static_cast<std::size_t>(slot)];
          });
    }
    const auto solid = [](double) { return Dashes{1.0, 1.0}; };
    // Outer edge; in town only short dashes along parked cars.
    paint_line(
        painter, 0.18, [&](double s) { return maker.profile(s).parking_m < 0.1; }, solid,
        [&](double s) { return sign * (maker.profile(s).lanes_edge(right) + 0.12); });
    paint_line(
        painter, 0.1,
        [&](double s) {
          return maker.profile(s).parking_m > 1.9 && !near_opening(maker, s, right) &&
                 !crossing_near(s);
        },
        [](double) {
          return Dashes{1.0, 3.0};
        },
        [&](double s) { return sign * (maker.profile(s).lanes_edge(right) + 0.3); });
    // Inner edge, at the median.
    paint_line(
        painter, 0.18, [&](double s) { return maker.profile(s).median_half_m > 0.3; }, solid,
        [&](double s) {
          const Profile profile = maker.profile(s);
          return sign * (profile.median_half_m + profile.inner_m - 0.1);
        });
  }
}

// Zebra crossing with the lines where one stops.
void paint_crossing(Painter& painter, double middle_m) {
  const Profile profile = painter.maker.profile(middle_m);
  const double right = -profile.edge(true) + 0.3;
  const double left = profile.edge(false) - 0.3;
  for (const double y : steps(right, left - 0.5, 1.0)) {
    painter.bar(middle_m - 1.5, middle_m + 1.5, y, y + 0.5);
  }
  painter.bar(middle_m - 3.0, middle_m - 2.7, -profile.lanes_edge(true) + 0.1, -0.15);
  painter.bar(middle_m + 2.7, middle_m + 3.0, 0.15, profile.lanes_edge(false) - 0.1);
}

// Straight-on arrow; points the way traffic goes.
void paint_arrow(Painter& painter, double s, double left, double direction) {
  painter.bar(s, s + direction * 3.0, left - 0.08, left + 0.08);
  constexpr int kSteps = 16;
  constexpr double kHead_m = 1.6;
  for (int i = 0; i < kSteps; ++i) {  // the head
    const double at = s + direction * (3.0 + kHead_m * i / kSteps);
    const double half = 0.36 * (1.0 - static_cast<double>(i) / kSteps);
    painter.bar(at, at + direction * 0.11, left - half, left + half);
  }
}

void paint_symbols(Painter& painter) {
  Maker& maker = painter.maker;
  Random random(maker.draw(0xA220));
  for (const double s : random_steps(random, maker.first_m() + 10.0, maker.last_m(), 35.0, 90.0)) {
    const Section& section = section_at(maker.world.sections, s);
    if (section.setting == Setting::kTunnel) {
      continue;
    }
    for (const Lane& lane : maker.world.lanes(s)) {
      if (random.chance(0.5)) {
        paint_arrow(painter, s + random.uniform(0.0, 12.0), lane.left_m, lane.forward ? 1.0 : -1.0);
      }
    }
  }
  // Speed bumps are painted with teeth.
  const auto pieces = static_cast<std::int64_t>(maker.last_m() / kSpeedBumpPiece_m) + 1;
  for (std::int64_t piece = 0; piece < pieces; ++piece) {
    const auto middle_m =
        speed_bump_in(maker.world.spec.seed, maker.world.route, maker.world.sections, piece);
    if (!middle_m) {
      continue;
    }
    for (const double y : steps(-2.9, 3.0, 0.9)) {
      painter.bar(*middle_m - 2.0, *middle_m - 1.1, y, y + 0.45);
      painter.bar(*middle_m + 1.1, *middle_m + 2.0, y, y + 0.45);
    }
  }
}

}  // namespace

void make_markings(Maker& maker) {
  MeshBuilder builder = maker.unique();
  Random random(maker.draw(0xFA17));
  const std::uint32_t surface = builder.surface(
      Material::kRoadMarking, random, {static_cast<float>(random.uniform(0.25, 0.6)), 0.12F});
  Painter painter{maker, builder, surface};
  paint_lanes(painter);
  for (const double crossing : maker.crossings) {
    paint_crossing(painter, crossing);
  }
  paint_symbols(painter);
}

}  // namespace topoloc::world
