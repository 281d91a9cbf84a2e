// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/ambient.hpp"

#include "topoloc/world/random.hpp"

#include "rendering/hemisphere.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace topoloc::rendering {
namespace {

constexpr double kCell_m = 0.5;         // on facets
constexpr double kCoarse = 0.03;        // of the distance: some ten pixels
constexpr double kPlantCell_m = 1.0;    // between leaves
constexpr double kPlantCoarse = 0.04;   // of the distance: leaves hide what goes on among them
constexpr double kVehicleCell_m = 1.0;  // above vehicles
constexpr double kVehicleHeight_m = 3.0;
constexpr double kBounceReach_m = 60.0;
constexpr int kRounds = 8;  // of rays to a hemisphere, at most
// Nodes lie above thin layers (markings on asphalt) and off the edges of their facet (feet of
// walls).
constexpr double kLift_m = 0.03;
constexpr double kInset_m = 0.04;

/// Poles are as thin as plants.
enum class Kind : std::uint8_t { kFacet, kPlant, kVehicle };

Kind kind_of(world::Material material) {
  switch (material) {
    case world::Material::kFoliage:
    case world::Material::kBark:
    case world::Material::kPole:
      return Kind::kPlant;
    case world::Material::kCarBody:
    case world::Material::kCarGlass:
    case world::Material::kTyre:
      return Kind::kVehicle;
    default:
      return Kind::kFacet;
  }
}

/// Distance between nodes: doubled until it is no shorter than half of the footprint.
double spacing_m(double least_m, double footprint_m) {
  constexpr double kMost = 32.0;
  double factor = 1.0;
  while (2.0 * factor * least_m < footprint_m && factor < kMost) {
    factor *= 2.0;
  }
  return factor * least_m;
}

/// Shortest distance between nodes. Before facades there is little that would hide light from them,
/// and rails are too thin to matter.
double finest_m(world::Material material) {
  switch (material) {
    case world::Material::kFacade:
    case world::Material::kGuardRail:
    case world::Material::kRoof:
      return 2.0 * kCell_m;
    default:
      return kCell_m;
  }
}

/// As many directions to all sides.
const std::array<Eigen::Vector3d, kHemisphereRays>& sphere() {
  static const auto directions = [] {
    std::array<Eigen::Vector3d, kHemisphereRays> result;
    const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < kHemisphereRays; ++i) {
      const double z = 1.0 - (2.0 * i + 1.0) / kHemisphereRays;
      const double r = std::sqrt(1.0 - z * z);
      result[static_cast<std::size_t>(i)] = {r * std::cos(golden * i), r * std::sin(golden * i), z};
    }
    return result;
  }();
  return directions;
}

float mixed(float a, float b, double share) { return std::lerp(a, b, static_cast<float>(share)); }

std::uint64_t bits(std::int64_t value) { return static_cast<std::uint64_t>(value); }

/// Point of a convex polygon next to p.
Eigen::Vector2d clamped(const Eigen::Vector2d& p, std::span<const Eigen::Vector2d> corners) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const double area = cross(corners[1] - corners[0], corners[2] - corners[0]);
  bool inside = true;
  Eigen::Vector2d nearest = p;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d ab = corners[(i + 1) % corners.size()] - a;
    if (cross(ab, p - a) * area < 0.0) {
      inside = false;
    }
    const double share = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12), 0.0, 1.0);
    const Eigen::Vector2d q = a + share * ab;
    if ((q - p).squaredNorm() < least) {
      least = (q - p).squaredNorm();
      nearest = q;
    }
  }
  return inside ? p : nearest;
}

}  // namespace

Ambient::Ambient(const Raycaster& raycaster, const Illumination& light, const Sky& sky)
    : raycaster_(&raycaster), light_(light), sky_(&sky) {}

float Ambient::at(const Hit& hit, double footprint_m) {
  switch (kind_of(hit.surface->material)) {
    case Kind::kPlant:
      return in_plant(hit, footprint_m);
    case Kind::kVehicle:
      return on_vehicle(hit);
    case Kind::kFacet:
      break;
  }
  return hit.moving ? on_vehicle(hit) : on_facet(hit, footprint_m);
}

template <typename Where>
float Ambient::remembered(std::uint64_t key, Gather gather, const Where& where) {
  key |= 1U;  // 0 is a free slot
  if (const auto known = cache_.find(key)) {
    return *known;
  }
  const std::pair<Eigen::Vector3d, Eigen::Vector3d> place = where();
  const float irradiance = gathered(place.first, place.second, gather);
  cache_.add(key, irradiance);
  return irradiance;
}

/// A grid in the plane of the two axes that the facet is seen best along; nodes beyond its edges
/// stand for the edge.
float Ambient::on_facet(const Hit& hit, double footprint_m) {
  const Facet facet = raycaster_->facet(hit);
  const Eigen::Vector3d& n = facet.normal;
  Eigen::Index dropped = 0;
  n.cwiseAbs().maxCoeff(&dropped);
  const Eigen::Index s = (dropped + 1) % 3;
  const Eigen::Index t = (dropped + 2) % 3;
  const auto flat = [&](const Eigen::Vector3d& p) { return Eigen::Vector2d(p[s], p[t]); };
  std::array<Eigen::Vector2d, 4> flat_corners;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector2d least = flat(facet.corners[0]);
  Eigen::Vector2d most = least;
  for (std::size_t i = 0; i < facet.count; ++i) {
    flat_corners[i] = flat(facet.corners[i]);
    least = least.cwiseMin(flat_corners[i]);
    most = most.cwiseMax(flat_corners[i]);
    middle += facet.corners[i] / static_cast<double>(facet.count);
  }
  const bool front = hit.normal.dot(n) > 0.0;
  const Eigen::Vector3d outwards = front ? n : Eigen::Vector3d(-n);

  const auto lifted = [&](const Eigen::Vector2d& p) {
    Eigen::Vector3d point;
    point[s] = p.x();
    point[t] = p.y();
    point[dropped] =
        middle[dropped] - (n[s] * (p.x() - middle[s]) + n[t] * (p.y() - middle[t])) / n[dropped];
    const Eigen::Vector3d inwards = middle - point;
    const double length_m = inwards.norm();
    point += inwards * (std::min(kInset_m, 0.5 * length_m) / std::max(length_m, 1e-9));
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>(point + kLift_m * outwards, outwards);
  };
  const double cell =
      spacing_m(finest_m(hit.surface->material), std::max(footprint_m, kCoarse * hit.distance_m));
  const Eigen::Vector2d size_m = most - least;
  const std::uint64_t side = front ? 1 : 0;
  if (size_m.maxCoeff() < cell) {  // one node for small ones; blades of grass share some
    if (hit.surface->material == world::Material::kGrass) {
      return in_plant(hit, footprint_m);
    }
    return remembered(world::key(hit.object, {facet.id, side}), Gather::kHemisphere,
                      [&] { return lifted(flat(middle)); });
  }
  Eigen::Vector2d at = flat(hit.point_m) / cell;
  Eigen::Vector2d corner = at.array().floor();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {  // one row of nodes for strips
    if (size_m[axis] < cell) {
      at[axis] = corner[axis] = 0.5 * (least[axis] + most[axis]) / cell;
    }
  }
  const auto node = [&](int i, int j) {
    const Eigen::Vector2d p = corner + Eigen::Vector2d(i, j);
    const std::uint64_t key =
        world::key(hit.object, {facet.id, side, bits(std::llround(2.0 * cell)),
                                bits(std::llround(p.x())), bits(std::llround(p.y()))});
    return remembered(key, Gather::kHemisphere, [&] {
      return lifted(clamped(cell * p, std::span(flat_corners).first(facet.count)));
    });
  };
  const Eigen::Vector2d share = at - corner;
  const auto row = [&](int j) {
    return share.x() > 0.0 ? mixed(node(0, j), node(1, j), share.x()) : node(0, j);
  };
  return share.y() > 0.0 ? mixed(row(0), row(1), share.y()) : row(0);
}

float Ambient::in_space(const Eigen::Vector3d& point_m, double size_m, Gather gather) {
  const Eigen::Vector3d at = point_m / size_m;
  const Eigen::Vector3d corner = at.array().floor();
  const Eigen::Vector3d share = at - corner;
  const auto node = [&](int i, int j, int k) {
    const Eigen::Vector3d p = corner + Eigen::Vector3d(i, j, k);
    const std::uint64_t key =
        world::key(0x5ACEU + static_cast<std::uint64_t>(gather),
                   {bits(std::llround(100.0 * size_m)), bits(std::llround(p.x())),
                    bits(std::llround(p.y())), bits(std::llround(p.z()))});
    return remembered(key, gather, [&] {
      return std::pair<Eigen::Vector3d, Eigen::Vector3d>(size_m * p, Eigen::Vector3d::UnitZ());
    });
  };
  const auto plane = [&](int k) {
    return mixed(mixed(node(0, 0, k), node(1, 0, k), share.x()),
                 mixed(node(0, 1, k), node(1, 1, k), share.x()), share.y());
  };
  return mixed(plane(0), plane(1), share.z());
}

/// Leaves lie in all directions and let light through.
float Ambient::in_plant(const Hit& hit, double footprint_m) {
  return in_space(hit.point_m,
                  spacing_m(kPlantCell_m, std::max(footprint_m, kPlantCoarse * hit.distance_m)),
                  Gather::kSphere);
}

/// What reaches a place above the vehicle, by how far a part of it faces up; below there is light
/// that the road reflects.
float Ambient::on_vehicle(const Hit& hit) {
  const Eigen::Vector3d above(hit.point_m.x(), hit.point_m.y(),
                              raycaster_->place(hit).z() + kVehicleHeight_m);
  const auto up = static_cast<float>(0.5 + 0.5 * hit.normal.z());
  return in_space(above, kVehicleCell_m, Gather::kHemisphere) * (up + kBounceAlbedo * (1.0F - up));
}

/// Rays from a place to all sides; of half of those that meet something, whether the sun lights it.
/// Where few of them find light, as in a tunnel's mouth, each is a step on the wall: there are
/// more.
float Ambient::gathered(const Eigen::Vector3d& from_m, const Eigen::Vector3d& normal,
                        Gather gather) const {
  constexpr int kDarkRounds = 2;  // then it is dark
  constexpr int kEnough = 12;
  // A sphere's rays are the same in each round.
  const int most_rounds = gather == Gather::kHemisphere ? kRounds : 1;
  const Eigen::Matrix3d R = frame_of(normal);
  float sum = 0.0F;
  int bright = 0;
  int rounds = 0;
  do {
    const double turn = 2.0 * std::numbers::pi * rounds / kRounds;
    const Eigen::Matrix3d turned =
        R * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Gathered round = gathered_once(from_m, turned, gather);
    sum += round.irradiance;
    bright += round.bright;
    ++rounds;
  } while (rounds < most_rounds && bright < kEnough && (bright > 0 || rounds < kDarkRounds));
  return sum / static_cast<float>(rounds);
}

Ambient::Gathered Ambient::gathered_once(const Eigen::Vector3d& from_m, const Eigen::Matrix3d& R,
                                         Gather gather) const {
  std::array<Ray, kHemisphereRays> rays;
  std::array<std::optional<Hit>, kHemisphereRays> hits;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i] = {from_m, gather == Gather::kHemisphere ? R * hemisphere()[i] : sphere()[i]};
  }
  raycaster_->cast(rays, hits, Obstacles::kFixed);

  Gathered sum;
  float openness = 0.0F;
  float facing_up = 0.0F;
  bool skip = false;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i]) {
      const bool sky = rays[i].direction.z() > 0.0;
      sum.irradiance += sky ? sky_->mean_radiance(rays[i].direction) : 0.0F;
      sum.bright += sky ? 1 : 0;
      openness += sky ? 1.0F : 0.0F;
      continue;
    }
    skip = !skip;
    if (gather == Gather::kSphere || skip || hits[i]->distance_m > kBounceReach_m) {
      continue;
    }
    const Hit& met = *hits[i];
    facing_up += static_cast<float>(0.5 + 0.5 * met.normal.z());
    const double cosine = met.normal.dot(light_.to_sun);
    if (light_.sun > 0.0 && cosine > 0.0 &&
        !raycaster_->blocked({off_surface(met), light_.to_sun}, Obstacles::kFixed)) {
      sum.irradiance += 2.0F * kBounceAlbedo * static_cast<float>(light_.sun * cosine);
      ++sum.bright;
    }
  }
  // What is met sees about as much of the sky as the place itself; a street's half of it is open.
  const float open = std::min(1.0F, 2.0F * openness / kHemisphereRays);
  sum.irradiance += 2.0F * kBounceAlbedo * sky_->irradiance() * open * facing_up;
  if (gather == Gather::kSphere) {  // what leaves and ground reflect is not followed
    sum.irradiance += kBounceAlbedo * sky_->irradiance() * openness;
  }
  sum.irradiance /= static_cast<float>(kHemisphereRays);
  return sum;
}

}  // namespace topoloc::rendering
