// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/town_lots.hpp"

#include "world/garden.hpp"
#include "world/house.hpp"
#include "world/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace topoloc::world {
namespace {

/// How a part of the town is built.
struct District {
  bool closed = true;      ///< houses in rows at the footway; else gardens between them
  double setback_m = 0.0;  ///< of fronts from the footway
  double shops = 0.4;      ///< share of houses
  int storeys = 3;
};

District district_at(const Maker& maker, double along_m, bool right) {
  constexpr double kDistrict_m = 130.0;
  const auto piece = static_cast<std::uint64_t>(std::floor(along_m / kDistrict_m) + 1000.0);
  Random random(maker.draw(0xD157, piece * 2 + (right ? 1 : 0)));
  District result;
  result.closed = random.chance(0.6);
  result.setback_m = result.closed ? random.uniform(0.15, 0.6) : random.uniform(2.2, 5.5);
  result.shops = result.closed ? random.uniform(0.2, 0.7) : 0.04;
  result.storeys = result.closed ? 2 + random.below(4) : 1 + random.below(2);
  return result;
}

/// Frame of a lot and how much ground it may take: x along the street, y away from it.
struct Lot {
  RigidTransform frame;
  double width_m = 0.0;
};

// From one point of a footway's back to another.
Lot lot_between(const Point& from, const Point& middle, const Point& to, bool mirrored,
                double setback_m) {
  Lot lot;
  Point x = to - from;
  x.z() = 0.0;
  lot.width_m = x.norm();
  x /= lot.width_m;
  const Point y = (mirrored ? 1.0 : -1.0) * Point(-x.y(), x.x(), 0.0);
  lot.frame.R.col(0) = x;
  lot.frame.R.col(1) = y;
  lot.frame.R.col(2) = Point::UnitZ();
  // On the outside of a bend the footway bulges over the line between two of its points.
  const double bulge_m = std::max(0.0, (middle - 0.5 * (from + to)).dot(y));
  lot.frame.p = from + (setback_m + bulge_m) * y;
  lot.frame.p.z() = std::max(from.z(), to.z()) + 0.03;
  return lot;
}

bool take(Maker& maker, const Lot& lot, double from_x, double width_m, double depth_m,
          double setback_m) {
  // The site's cells are coarse: those of the footway reach over its edge.
  constexpr double kCells_m = 0.85;
  const double inset_m = std::max(0.12, kCells_m - setback_m);
  const Eigen::Vector2d x = lot.frame.R.col(0).head<2>();
  const Eigen::Vector2d y = lot.frame.R.col(1).head<2>();
  const Eigen::Vector2d corner = lot.frame.p.head<2>() + from_x * x + inset_m * y;
  if (!maker.site.is_free(corner, width_m * x, depth_m * y)) {
    return false;
  }
  maker.site.claim(corner, width_m * x, depth_m * y);
  return true;
}

HouseForm house_form(Random& random, const District& district, double width_m) {
  HouseForm form;
  form.width_m = width_m;
  form.depth_m = random.uniform(8.5, 12.5);
  form.storeys = std::clamp(district.storeys + random.below(3) - 1, 1, 6);
  form.storey_m = random.uniform(2.75, 3.3);
  form.shop = random.chance(district.shops);
  form.detached = !district.closed;
  form.flat_roof = random.chance(district.closed ? 0.3 : 0.1);
  return form;
}

/// One side of one street.
struct Row {
  std::function<Point(double)> back;  ///< back of the footway
  double begin_m;
  double end_m;
  bool mirrored;  ///< lots lie to the left of the way
  std::function<District(double)> district;
  std::function<bool(double, double)> allowed;
  bool plain;
};

void build_row(Maker& maker, const Row& row, std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder = maker.unique();
  double s = row.begin_m;
  while (s < row.end_m - 6.0) {
    const District district = row.district(s);
    const double width_m =
        std::min(random.uniform(7.5, district.closed ? 15.0 : 13.0), row.end_m - s);
    const double gap_m = district.closed ? (random.chance(0.18) ? random.uniform(2.0, 5.0) : 0.0)
                                         : random.uniform(2.5, 8.0);
    if (!row.allowed(s, s + width_m)) {
      s += 1.5;
      continue;
    }
    const Lot lot = lot_between(row.back(s), row.back(s + 0.5 * width_m), row.back(s + width_m),
                                row.mirrored, district.setback_m);
    HouseForm form = house_form(random, district, lot.width_m);
    form.plain = row.plain;
    bool taken = false;
    for (const double depth_m : {form.depth_m, 6.5}) {
      if (!taken && take(maker, lot, 0.35, lot.width_m - 0.7, depth_m, district.setback_m)) {
        form.depth_m = depth_m;
        taken = true;
      }
    }
    if (!taken) {
      s += 1.5;
      continue;
    }
    builder.set_frame(lot.frame);
    add_house(builder, random, form);
    RigidTransform front = lot.frame;
    front.p = lot.frame.p - (district.setback_m - 0.1) * lot.frame.R.col(1);
    if (!district.closed) {
      const double gate_m = random.uniform(0.3, 0.6) * lot.width_m;
      add_boundary(maker, builder, random, front, gate_m);
      RigidTransform rest = front;
      rest.p = front * Point(gate_m + 1.3, 0.0, 0.0);
      add_boundary(maker, builder, random, rest, lot.width_m - gate_m - 1.3);
      plant_yard(maker, random, front, lot.width_m, district.setback_m, 3);
    }
    if (gap_m > 0.5 && row.allowed(s + width_m, s + width_m + gap_m)) {
      RigidTransform beside = front;
      beside.p = front * Point(lot.width_m, 0.0, 0.0);
      if (random.chance(0.75)) {
        add_boundary(maker, builder, random, beside, gap_m);
      }
      beside.p = front * Point(lot.width_m + 0.3, 1.0, 0.0);
      plant_yard(maker, random, beside, gap_m, 9.0, 2 + random.below(3));
    }
    s += width_m + gap_m;
  }
}

void build_side_street(Maker& maker, const SideStreet& street) {
  const RigidTransform T = side_frame(maker.world, street);
  const auto district = [&](double) {
    return district_at(maker, street.along_m + 400.0, street.right);
  };
  for (const double sign : {-1.0, 1.0}) {
    Row row;
    row.back = [T, sign](double x) { return T * Point(x, sign * kOpeningHalf_m, 0.12); };
    row.begin_m = 3.0;
    row.end_m = street.length_m;
    row.mirrored = sign > 0.0;
    row.district = district;
    row.allowed = [](double, double) { return true; };
    row.plain = true;
    build_row(maker, row, key(street.seed, {sign > 0.0 ? 1U : 2U}));
  }
  // What one sees at its end.
  Row end;
  end.back = [T, &street](double y) { return T * Point(street.length_m + 1.0, y, 0.0); };
  end.begin_m = -11.0;
  end.end_m = 11.0;
  end.mirrored = false;
  end.district = district;
  end.allowed = [](double, double) { return true; };
  end.plain = true;
  build_row(maker, end, key(street.seed, {3U}));
}

/// From where to where a section's side is not taken up by side streets. A little is added, for
/// side streets are straight where the road bends.
std::vector<std::pair<double, double>> between_side_streets(const Maker& maker,
                                                            const Section& section, bool right) {
  constexpr double kStep_m = 0.5;
  constexpr double kOverlap_m = 0.3;
  std::vector<std::pair<double, double>> stretches;
  double before = -std::numeric_limits<double>::infinity();
  for (const double s : steps(maker.begin_m(section), maker.end_m(section) + 1e-9, kStep_m)) {
    if (!maker.open(s, right, -kOverlap_m)) {
      continue;
    }
    if (s - before > 1.5 * kStep_m) {
      stretches.emplace_back(s, s);
    }
    stretches.back().second = std::min(s + kStep_m, maker.end_m(section));
    before = s;
  }
  return stretches;
}

// Earth, lawn or paving behind the footways.
void make_yards(Maker& maker, const Section& section) {
  constexpr double kReach_m = 14.0;
  constexpr double kPiece_m = 26.0;
  Random random(maker.draw(0x9A2D, section.seed));
  MeshBuilder builder = maker.unique();
  for (const bool right : {true, false}) {
    const double sign = right ? -1.0 : 1.0;
    const auto across = [&](double at) -> std::vector<Across> {
      const Profile profile = maker.profile(at);
      const double back = profile.edge(right) + profile.footway_m + 0.01;
      // Towards the inside of a bend the ground must not fold.
      const double inside = sign * maker.world.route.curvature_1pm(at);
      const double reach =
          inside > 0.0 ? std::clamp(0.85 / inside - back, 0.3, kReach_m) : kReach_m;
      const double up = profile.kerb_m - 0.01;
      return {{sign * back, up},
              {sign * (back + 0.3 * reach), up + 0.03},
              {sign * (back + reach), up - 0.02},
              {sign * (back + reach + 0.1), up - 1.5}};
    };
    for (const auto& [begin_m, end_m] : between_side_streets(maker, section, right)) {
      for (const double s : steps(begin_m, end_m, kPiece_m)) {
        const District district = district_at(maker, s, right);
        const std::uint32_t surface =
            builder.surface(district.closed ? Material::kGround : Material::kGrass,
                            static_cast<std::uint32_t>(random.next()), {0.0F, 0.2F});
        ribbon(builder, maker.route(), stations(s, std::min(s + kPiece_m, end_m), 2.0), across,
               surface);
      }
    }
  }
}

}  // namespace

void make_town_lots(Maker& maker, const Section& section) {
  make_yards(maker, section);
  for (const bool right : {true, false}) {
    const double sign = right ? -1.0 : 1.0;
    Row row;
    row.back = [&maker, sign, right](double s) {
      const Profile profile = maker.profile(s);
      return maker.world.route.point(s, sign * (profile.edge(right) + profile.footway_m),
                                     profile.kerb_m);
    };
    row.begin_m = maker.begin_m(section);
    row.end_m = maker.end_m(section);
    row.mirrored = !right;
    row.district = [&maker, right](double s) { return district_at(maker, s, right); };
    row.allowed = [&maker, right](double from, double to) {
      for (const double s : steps(from, to + 1e-9, 2.0)) {
        if (!maker.open(s, right, 0.3) || maker.profile(s).footway_m < 1.6) {
          return false;
        }
      }
      return maker.open(to, right, 0.3);
    };
    row.plain = false;
    build_row(maker, row, maker.draw(0x10F5, section.seed + (right ? 1 : 2)));
  }
  for (const SideStreet& street : maker.side_streets) {
    if (street.along_m >= maker.begin_m(section) && street.along_m < maker.end_m(section)) {
      build_side_street(maker, street);
    }
  }
}

}  // namespace topoloc::world
