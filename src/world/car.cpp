// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/steps.hpp"
#include "world/world_maker.hpp"

#include <array>
#include <cmath>

namespace topoloc::world {
namespace {

/// A vehicle's side view, from its rear to its front: heights of belt line and roof.
struct Station {
  double x_m;     ///< forward of the rear axle
  double low_m;   ///< underside
  double belt_m;  ///< where the body ends and the windows begin
  double roof_m;  ///< equal to the belt: bonnet, boot
  double half_m;  ///< half width at the belt
};

struct Model {
  std::vector<Station> stations;
  double wheel_base_m;
  double wheel_m;  ///< radius
  bool windows;    ///< along the sides behind the front seats
};

constexpr double kRoofIn_m = 0.17;  // sides of the cabin lean in

Model hatchback() {
  return {{{-0.72, 0.42, 0.72, 0.72, 0.74},
           {-0.70, 0.26, 0.98, 0.98, 0.80},
           {-0.42, 0.22, 0.99, 1.40, 0.86},
           {0.35, 0.20, 0.97, 1.48, 0.88},
           {1.25, 0.20, 0.95, 1.45, 0.88},
           {2.05, 0.20, 0.93, 0.95, 0.87},
           {2.85, 0.22, 0.84, 0.84, 0.84},
           {3.28, 0.26, 0.68, 0.68, 0.74},
           {3.33, 0.38, 0.56, 0.56, 0.68}},
          2.55,
          0.31,
          true};
}

Model sedan() {
  return {{{-0.98, 0.42, 0.78, 0.78, 0.74},
           {-0.94, 0.28, 1.00, 1.00, 0.82},
           {-0.38, 0.22, 1.02, 1.03, 0.88},
           {0.25, 0.20, 1.00, 1.40, 0.90},
           {0.95, 0.20, 0.97, 1.45, 0.91},
           {1.45, 0.20, 0.95, 1.42, 0.91},
           {2.25, 0.20, 0.93, 0.95, 0.90},
           {3.15, 0.22, 0.84, 0.84, 0.87},
           {3.62, 0.26, 0.68, 0.68, 0.76},
           {3.68, 0.38, 0.56, 0.56, 0.68}},
          2.75,
          0.32,
          true};
}

Model estate() {
  return {{{-1.02, 0.42, 0.80, 0.80, 0.76},
           {-0.98, 0.28, 1.03, 1.03, 0.82},
           {-0.72, 0.22, 1.02, 1.44, 0.88},
           {0.4, 0.20, 0.99, 1.50, 0.90},
           {1.4, 0.20, 0.96, 1.46, 0.91},
           {2.2, 0.20, 0.94, 0.96, 0.90},
           {3.1, 0.22, 0.86, 0.86, 0.87},
           {3.6, 0.26, 0.70, 0.70, 0.77},
           {3.66, 0.38, 0.58, 0.58, 0.68}},
          2.75,
          0.32,
          true};
}

Model off_roader() {
  return {{{-0.86, 0.5, 0.95, 0.95, 0.80},
           {-0.84, 0.34, 1.12, 1.12, 0.87},
           {-0.66, 0.30, 1.13, 1.66, 0.92},
           {0.4, 0.30, 1.11, 1.73, 0.94},
           {1.45, 0.30, 1.09, 1.70, 0.94},
           {2.1, 0.30, 1.07, 1.10, 0.93},
           {2.95, 0.31, 1.02, 1.02, 0.91},
           {3.45, 0.34, 0.86, 0.86, 0.82},
           {3.52, 0.46, 0.70, 0.70, 0.74}},
          2.7,
          0.37,
          true};
}

Model van() {
  return {{{-1.06, 0.5, 1.0, 1.0, 0.90},
           {-1.05, 0.34, 1.2, 2.28, 0.97},
           {0.5, 0.30, 1.2, 2.36, 0.99},
           {2.3, 0.30, 1.18, 2.34, 0.99},
           {3.05, 0.30, 1.14, 2.0, 0.97},
           {3.75, 0.31, 1.12, 1.15, 0.94},
           {4.2, 0.34, 0.92, 0.92, 0.86},
           {4.26, 0.44, 0.7, 0.7, 0.78}},
          3.3,
          0.35,
          false};
}

// A panel between two stations, on one side or (sign 0) across the top.
void loft(MeshBuilder& builder, const Point& a, const Point& b, const Point& c, const Point& d,
          std::uint32_t surface) {
  builder.corners(a, b, c, d, surface, Uv(a.x() + 3.0, a.z()));
}

void add_wheel(MeshBuilder& builder, double x, double side_m, double radius_m, double out,
               std::uint32_t tyre, std::uint32_t rim) {
  const Point middle(x, side_m, radius_m);
  const Point inner = middle - Point(0.0, out * 0.2, 0.0);
  builder.bar(inner, middle, radius_m, radius_m, 14, tyre, true);
  const Point face = middle + Point(0.0, out * 0.006, 0.0);
  builder.bar(face - Point(0.0, out * 0.02, 0.0), face, 0.64 * radius_m, 0.6 * radius_m, 10, rim,
              true);
}

struct Paint {
  std::uint32_t body;
  std::uint32_t glass;
  std::uint32_t tyre;
  std::uint32_t rim;
  std::uint32_t plate;
  std::uint32_t lamp;
  std::uint32_t trim;
};

Paint paint_of(MeshBuilder& builder, std::uint32_t seed) {
  return {builder.surface(Material::kCarBody, seed),
          builder.surface(Material::kCarGlass, seed + 1),
          builder.surface(Material::kTyre, seed + 2),
          builder.surface(Material::kTyre, seed + 3, {1.0F}),
          builder.surface(Material::kPlate, seed + 4, {0.52F, 0.11F}),
          builder.surface(Material::kCarBody, seed + 5, {1.0F}),
          builder.surface(Material::kCarBody, seed + 6, {2.0F})};
}

void add_body(MeshBuilder& builder, const Model& model, const Paint& paint) {
  const auto& st = model.stations;
  for (std::size_t i = 0; i + 1 < st.size(); ++i) {
    const Station& a = st[i];
    const Station& b = st[i + 1];
    const auto roof_half = [](const Station& s) {
      return s.half_m - kRoofIn_m * std::min(1.0, (s.roof_m - s.belt_m) / 0.4);
    };
    const bool cabin = a.roof_m - a.belt_m > 0.1 || b.roof_m - b.belt_m > 0.1;
    const bool screen = cabin && std::abs(b.roof_m - a.roof_m) > 0.25;
    for (const double sign : {-1.0, 1.0}) {
      const auto at = [&](const Station& s, double half, double z) {
        return Point(s.x_m, sign * half, z);
      };
      const double mid_a = 0.55 * a.low_m + 0.45 * a.belt_m;
      const double mid_b = 0.55 * b.low_m + 0.45 * b.belt_m;
      loft(builder, at(a, a.half_m - 0.06, a.low_m), at(b, b.half_m - 0.06, b.low_m),
           at(b, b.half_m, mid_b), at(a, a.half_m, mid_a), paint.trim);
      loft(builder, at(a, a.half_m, mid_a), at(b, b.half_m, mid_b),
           at(b, b.half_m - 0.02, b.belt_m), at(a, a.half_m - 0.02, a.belt_m), paint.body);
      if (cabin) {
        const bool glazed = model.windows || a.x_m > 1.9;
        loft(builder, at(a, a.half_m - 0.02, a.belt_m), at(b, b.half_m - 0.02, b.belt_m),
             at(b, roof_half(b), b.roof_m), at(a, roof_half(a), a.roof_m),
             glazed ? paint.glass : paint.body);
      }
    }
    loft(builder, Point(a.x_m, -roof_half(a), a.roof_m), Point(b.x_m, -roof_half(b), b.roof_m),
         Point(b.x_m, roof_half(b), b.roof_m), Point(a.x_m, roof_half(a), a.roof_m),
         screen ? paint.glass : paint.body);
    // Pillars between the side windows.
    if (cabin && model.windows && !screen) {
      for (const double sign : {-1.0, 1.0}) {
        const Point foot(b.x_m, sign * (b.half_m - 0.012), b.belt_m);
        const Point head(b.x_m, sign * (roof_half(b) + 0.008), b.roof_m);
        builder.quad(foot - Point(0.05, 0.0, 0.0), Point(0.1, 0.0, 0.0), head - foot, paint.body);
      }
    }
  }
  const Station& rear = st.front();
  const Station& front = st.back();
  for (const Station* end : {&rear, &front}) {
    builder.corners(Point(end->x_m, -end->half_m, end->low_m),
                    Point(end->x_m, end->half_m, end->low_m),
                    Point(end->x_m, end->half_m, end->belt_m),
                    Point(end->x_m, -end->half_m, end->belt_m), paint.trim);
  }
}

// `facing`: 1 ahead, -1 back; it reads from left to right from there.
void add_plate(MeshBuilder& builder, double x_m, double z_m, double facing, const Paint& paint) {
  builder.quad(Point(x_m, -0.26 * facing, z_m), Point(0.0, 0.52 * facing, 0.0),
               Point(0.0, 0.0, 0.11), paint.plate);
}

void add_details(MeshBuilder& builder, const Model& model, const Paint& paint) {
  const Station& rear = model.stations.front();
  const Station& front = model.stations.back();
  add_plate(builder, rear.x_m - 0.012, rear.low_m + 0.12, -1.0, paint);
  add_plate(builder, front.x_m + 0.012, front.low_m + 0.03, 1.0, paint);
  for (const double sign : {-1.0, 1.0}) {
    // Lamps sit on the corners.
    const Station& behind = model.stations[1];
    builder.box(
        Point(behind.x_m - 0.035, sign * (behind.half_m - 0.14) - 0.12, behind.belt_m - 0.28),
        Point(behind.x_m + 0.05, sign * (behind.half_m - 0.14) + 0.12, behind.belt_m - 0.1),
        paint.lamp, true);
    const Station& ahead = model.stations[model.stations.size() - 2];
    builder.box(Point(ahead.x_m - 0.12, sign * (ahead.half_m - 0.12) - 0.13, ahead.belt_m - 0.12),
                Point(ahead.x_m + 0.03, sign * (ahead.half_m - 0.12) + 0.12, ahead.belt_m + 0.015),
                paint.lamp, true);
    // Mirrors, at the foot of the wind screen.
    const Station& screen = model.stations[model.stations.size() - 4];
    builder.box(
        Point(screen.x_m - 0.15, sign * (screen.half_m + 0.08) - 0.09, screen.belt_m + 0.02),
        Point(screen.x_m - 0.03, sign * (screen.half_m + 0.08) + 0.09, screen.belt_m + 0.15),
        paint.body, true);
    for (const double x : {0.0, model.wheel_base_m}) {
      add_wheel(builder, x, sign * (model.stations[3].half_m - 0.02), model.wheel_m, sign,
                paint.tyre, paint.rim);
    }
    // Door gaps and handles.
    for (const double x : {0.95, 2.0}) {
      builder.box(Point(x, sign * (model.stations[3].half_m - 0.005) - 0.006, 0.42),
                  Point(x + 0.018, sign * (model.stations[3].half_m - 0.005) + 0.006, 0.93),
                  paint.tyre);
    }
  }
}

// Cab and box, or a bus: boxes on wheels.
void add_lorry(MeshBuilder& builder, const Paint& paint, bool bus) {
  const double front = bus ? 8.6 : 6.4;
  const double rear = bus ? -3.2 : -2.2;
  const double half = 1.24;
  if (bus) {
    builder.box(Point(rear, -half, 0.35), Point(front, half, 1.35), paint.body, true);
    builder.box(Point(rear + 0.05, -half + 0.02, 1.35), Point(front - 0.02, half - 0.02, 2.5),
                paint.glass);
    builder.box(Point(rear, -half, 2.5), Point(front, half, 3.05), paint.body);
    for (const double x : steps(rear + 1.4, front - 0.5, 1.5)) {
      for (const double sign : {-1.0, 1.0}) {
        builder.quad(Point(x, sign * (half + 0.003), 1.35), Point(0.14, 0.0, 0.0),
                     Point(0.0, 0.0, 1.15), paint.trim);
      }
    }
  } else {
    builder.box(Point(rear, -half, 1.05), Point(front - 2.3, half, 3.6), paint.body, true);
    builder.box(Point(rear, -0.5, 0.6), Point(front - 2.0, 0.5, 1.05), paint.trim, true);
    builder.box(Point(front - 2.0, -half + 0.04, 0.45), Point(front, half - 0.04, 1.75), paint.body,
                true);
    builder.box(Point(front - 1.9, -half + 0.07, 1.75), Point(front - 0.05, half - 0.07, 2.65),
                paint.glass);
    builder.box(Point(front - 2.0, -half + 0.06, 2.65), Point(front - 0.15, half - 0.06, 2.95),
                paint.body);
    for (const double sign : {-1.0, 1.0}) {
      builder.box(Point(0.9, sign * 1.15 - 0.03, 0.5), Point(3.6, sign * 1.15 + 0.03, 0.85),
                  paint.trim, true);
    }
  }
  for (const double sign : {-1.0, 1.0}) {
    for (const double x : {0.0, bus ? 5.8 : 4.6}) {
      add_wheel(builder, x, sign * 1.22, 0.5, sign, paint.tyre, paint.rim);
    }
    builder.box(Point(rear - 0.03, sign * 0.95 - 0.18, 0.75),
                Point(rear + 0.02, sign * 0.95 + 0.18, 0.95), paint.lamp, true);
    builder.box(Point(front - 0.02, sign * 0.9 - 0.2, 0.7),
                Point(front + 0.03, sign * 0.9 + 0.2, 0.9), paint.lamp, true);
    builder.box(Point(front - 0.15, sign * 1.36 - 0.1, 1.7), Point(front, sign * 1.36 + 0.1, 2.2),
                paint.trim, true);
  }
  add_plate(builder, rear - 0.04, 0.6, -1.0, paint);
  add_plate(builder, front + 0.04, 0.5, 1.0, paint);
}

}  // namespace

void make_cars(Maker& maker) {
  std::uint32_t seed = 100;
  for (const Model& model : {hatchback(), sedan(), estate(), off_roader(), van()}) {
    std::uint32_t index = 0;
    MeshBuilder builder = maker.prototype(index);
    const Paint paint = paint_of(builder, seed += 10);
    add_body(builder, model, paint);
    add_details(builder, model, paint);
    maker.world.car_meshes.push_back(index);
  }
  for (const bool bus : {false, true}) {
    std::uint32_t index = 0;
    MeshBuilder builder = maker.prototype(index);
    add_lorry(builder, paint_of(builder, seed += 10), bus);
    maker.world.car_meshes.push_back(index);
  }
}

}  // namespace topoloc::world
