// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/raycaster.hpp"

#include "unit/rendering/small_world.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace topoloc::rendering {
namespace {

using test::add_box;
using test::add_rectangle;
using test::add_surface;
using test::car_at;
using test::street;

Eigen::Vector3d random_direction(world::Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  return Eigen::Vector3d(x, y, random.normal()).normalized();
}

/// Nearest hit of all triangles of an instance, by solving for each of them.
double brute_force(const world::World& world, const world::Instance& instance, const Ray& ray) {
  const world::Mesh& mesh = world.meshes[instance.mesh];
  double nearest = std::numeric_limits<double>::infinity();
  for (const world::Triangle& triangle : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] =
          instance.T_world_mesh * (static_cast<double>(instance.scale) *
                                   mesh.vertices[triangle.vertices[i]].position_m.cast<double>());
    }
    Eigen::Matrix3d A;
    A << p[1] - p[0], p[2] - p[0], -ray.direction;
    const Eigen::Vector3d x = A.inverse() * (ray.origin_m - p[0]);
    if (x.allFinite() && x[0] >= 0.0 && x[1] >= 0.0 && x[0] + x[1] <= 1.0 && x[2] > 0.0) {
      nearest = std::min(nearest, x[2]);
    }
  }
  return nearest;
}

TEST(Raycaster, MeetsAPlaneWhereGeometrySays) {
  world::World world;
  world.meshes.resize(1);
  add_rectangle(world.meshes[0], {-500.0F, -500.0F, 0.0F}, {1000.0F, 0.0F, 0.0F},
                {0.0F, 1000.0F, 0.0F}, add_surface(world, world::Material::kAsphalt));
  const Raycaster raycaster(world, {});
  world::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    Ray ray;
    ray.origin_m = {random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0),
                    random.uniform(-3.0, 3.0)};
    ray.direction = random_direction(random);
    const double expected_m = -ray.origin_m.z() / ray.direction.z();
    const auto hit = raycaster.cast(ray);
    const Eigen::Vector3d point = ray.origin_m + expected_m * ray.direction;
    if (point.head<2>().cwiseAbs().maxCoeff() > 499.9) {
      continue;
    }
    ASSERT_EQ(hit.has_value(), expected_m > 0.0);
    if (hit) {
      EXPECT_NEAR(hit->distance_m, expected_m,
                  1e-9 * (1.0 + expected_m / std::abs(ray.direction.z())));
      EXPECT_NEAR((hit->point_m - point).norm(), 0.0, 1e-6);
      EXPECT_NEAR(hit->normal.z(), ray.origin_m.z() > 0.0 ? 1.0 : -1.0, 1e-12);
      EXPECT_NEAR(hit->uv_m.x(), point.x() + 500.0, 1e-3);
      EXPECT_NEAR(hit->uv_m.y(), point.y() + 500.0, 1e-3);
      EXPECT_EQ(hit->surface, world.surfaces.data());
      EXPECT_FALSE(hit->moving);
    }
  }
}

TEST(Raycaster, MeetsTurnedAndScaledInstancesWhereTheirTrianglesAre) {
  world::World world = street();
  world.meshes[0] = {};
  world.instances.clear();
  world::Random random(2);
  for (int i = 0; i < 30; ++i) {
    world::Instance instance;
    instance.mesh = 1;
    instance.seed = static_cast<std::uint32_t>(100 + i);
    instance.scale = static_cast<float>(random.uniform(0.5, 2.0));
    instance.T_world_mesh.R =
        Eigen::AngleAxisd(random.uniform(0.0, 3.0), random_direction(random)).toRotationMatrix();
    instance.T_world_mesh.p = 12.0 * random_direction(random);
    world.instances.push_back(instance);
  }
  const Raycaster raycaster(world, {});
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Ray ray{Eigen::Vector3d::Zero(), random_direction(random)};
    double expected_m = std::numeric_limits<double>::infinity();
    std::uint32_t seed = 0;
    for (const world::Instance& instance : world.instances) {
      const double distance_m = brute_force(world, instance, ray);
      if (distance_m < expected_m) {
        expected_m = distance_m;
        seed = instance.seed;
      }
    }
    const auto hit = raycaster.cast(ray);
    ASSERT_EQ(hit.has_value(), std::isfinite(expected_m));
    EXPECT_EQ(raycaster.blocked(ray), hit.has_value());
    if (hit) {
      ++hits;
      EXPECT_NEAR(hit->distance_m, expected_m, 1e-6);
      EXPECT_EQ(hit->instance, seed);
      EXPECT_LT(hit->normal.dot(ray.direction), 0.0);
      const Facet facet = raycaster.facet(*hit);
      EXPECT_NEAR(std::abs(facet.normal.dot(hit->normal)), 1.0, 1e-6);
      EXPECT_NEAR(facet.normal.dot(hit->point_m - facet.corners[0]), 0.0, 1e-6);
    }
  }
  EXPECT_GT(hits, 300);
}

TEST(Raycaster, TellsHowTextureGoesOnBesideAHit) {
  const world::World world = street();
  const Raycaster raycaster(world, std::vector<world::Instance>{car_at(20.0, -4.5, 0.7)});
  const Eigen::Vector3d from_m(0.0, -1.7, 1.5);
  int compared = 0;
  for (int i = 0; i < 400; ++i) {
    const double azimuth = -0.8 + 0.004 * i;
    const auto at = [&](double turned) {
      return raycaster.cast(
          {from_m, {std::cos(azimuth + turned), std::sin(azimuth + turned), -0.03}});
    };
    const auto a = at(0.0);
    const auto b = at(1e-4);
    if (a && b && a->object == b->object && a->triangle == b->triangle) {
      const Eigen::Vector2d uv_m =
          a->uv_m.cast<double>() + raycaster.uv_per_metre(*a) * (b->point_m - a->point_m);
      EXPECT_LT((uv_m - b->uv_m.cast<double>()).norm(), 1e-4);
      ++compared;
    }
  }
  EXPECT_GT(compared, 200);
}

TEST(Raycaster, FindsTheSameFacetFromBothOfItsTriangles) {
  world::World world;
  world.meshes.resize(1);
  const std::uint32_t surface = add_surface(world, world::Material::kConcrete);
  world::Mesh& mesh = world.meshes[0];
  mesh.vertices = {
      {{0.0F, -1.0F, -9.0F}, {}}, {{0.0F, 1.0F, -9.0F}, {}}, {{0.0F, 0.0F, -8.0F}, {}}};
  mesh.triangles = {{{0, 1, 2}, surface}};  // pairs begin at odd numbers too
  add_rectangle(mesh, {10.0F, 0.0F, 0.0F}, {0.0F, 4.0F, 0.0F}, {0.0F, 0.0F, 2.0F}, surface);
  add_rectangle(mesh, {10.0F, 5.0F, 0.0F}, {0.0F, 4.0F, 0.0F}, {0.0F, 0.0F, 2.0F}, surface);
  const Raycaster raycaster(world, {});
  const auto facet = [&](double y_m, double z_m) {
    return raycaster.facet(*raycaster.cast({{0.0, y_m, z_m}, Eigen::Vector3d::UnitX()}));
  };
  const Facet a = facet(3.5, 0.5);
  const Facet b = facet(0.5, 1.5);
  ASSERT_EQ(a.count, 4U);
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.corners, b.corners);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_NE(a.id, facet(6.0, 1.0).id);
  EXPECT_EQ(facet(0.0, -8.5).count, 3U);
}

TEST(Raycaster, CastsManyRaysAsOneByOne) {
  const world::World world = street();
  const std::vector<world::Instance> parked{car_at(20.0, -4.5), car_at(40.0, 4.5, 3.1)};
  const Raycaster raycaster(world, parked);
  world::Random random(3);
  std::vector<Ray> rays;
  for (int i = 0; i < 4003; ++i) {
    rays.push_back({{10.0, -1.7, 1.5}, random_direction(random)});
  }
  std::vector<std::optional<Hit>> hits(rays.size());
  raycaster.cast(rays, hits);
  int differing = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto one = raycaster.cast(rays[i]);
    if (one.has_value() != hits[i].has_value() ||
        (one && std::abs(one->distance_m - hits[i]->distance_m) > 1e-3)) {
      ++differing;  // rays that graze an edge, whose rounding differs
    }
  }
  EXPECT_LE(differing, 2);
}

TEST(Raycaster, PlacesMovingVehiclesAnew) {
  const world::World world = street();
  Raycaster raycaster(world, {});
  const Ray ahead{{10.0, -1.7, 1.0}, Eigen::Vector3d::UnitX(), 100.0};
  EXPECT_FALSE(raycaster.blocked(ahead));
  for (const double x_m : {30.0, 25.0}) {
    raycaster.place_moving(std::vector<world::Instance>{car_at(x_m, -1.7)});
    const auto hit = raycaster.cast(ahead);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_m, x_m - 1.0 - 10.0, 1e-6);
    EXPECT_TRUE(hit->moving);
    EXPECT_EQ(hit->instance, 77U);
    EXPECT_TRUE(raycaster.blocked(ahead));
    EXPECT_TRUE(raycaster.blocked(ahead, Obstacles::kMoving));
    EXPECT_FALSE(raycaster.blocked(ahead, Obstacles::kFixed));
    EXPECT_FALSE(raycaster.cast(ahead, Obstacles::kFixed));
    EXPECT_TRUE(raycaster.near_moving({x_m, 0.0, 0.0}, 3.0));
  }
  raycaster.place_moving({});
  EXPECT_FALSE(raycaster.blocked(ahead));
  EXPECT_FALSE(raycaster.near_moving({25.0, 0.0, 0.0}, 3.0));
}

TEST(Raycaster, EndsAtTheRaysLength) {
  const world::World world = street();
  const std::vector<world::Instance> parked{car_at(31.0, -1.7)};
  const Raycaster raycaster(world, parked);
  EXPECT_TRUE(raycaster.blocked({{10.0, -1.7, 1.0}, Eigen::Vector3d::UnitX(), 20.01}));
  EXPECT_FALSE(raycaster.blocked({{10.0, -1.7, 1.0}, Eigen::Vector3d::UnitX(), 19.99}));
  EXPECT_FALSE(raycaster.blocked({{10.0, -1.7, 1.0}, Eigen::Vector3d::UnitX(), -1.0}));
}

TEST(Raycaster, IsExactTenKilometresFromTheOrigin) {
  world::World world;
  world.meshes.resize(1);
  // Corners that single precision holds exactly.
  add_rectangle(world.meshes[0], {10000.0F, -8.0F, -4.0F}, {0.0F, 16.0F, 0.0F}, {0.0F, 0.0F, 8.0F},
                add_surface(world, world::Material::kFacade));
  const Raycaster raycaster(world, {});
  for (int i = 0; i < 200; ++i) {
    // Moves by less than single precision tells apart there (1 mm).
    const double back_m = 20.0 + 1e-4 * i;
    const auto hit = raycaster.cast({{10000.0 - back_m, 0.1, 0.2}, Eigen::Vector3d::UnitX()});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance_m, back_m, 1e-9);
    EXPECT_NEAR(hit->uv_m.x(), 8.1, 1e-5);
  }
}

TEST(Raycaster, RaysThatLeaveASurfaceDoNotMeetIt) {
  const world::World world = street();
  world::World far = world;
  for (world::Vertex& vertex : far.meshes[0].vertices) {
    vertex.position_m.x() += 10000.0F;
  }
  far.instances.clear();
  const Raycaster raycaster(far, {});
  world::Random random(4);
  int cast = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto hit = raycaster.cast({{10010.0, -1.7, 1.5}, random_direction(random)});
    if (hit) {
      ++cast;
      EXPECT_FALSE(raycaster.blocked({off_surface(*hit), hit->normal, 0.05})) << hit->point_m;
    }
  }
  EXPECT_GT(cast, 1000);
}

TEST(Raycaster, RefusesWhatIsNotThere) {
  world::World world = street();
  world::Instance instance;
  instance.mesh = 9;
  EXPECT_THROW(Raycaster(world, std::vector{instance}), std::invalid_argument);
  world.meshes[0].triangles[0].vertices[1] = 1'000'000;
  EXPECT_THROW(Raycaster(world, {}), std::invalid_argument);
  EXPECT_THROW(Raycaster(world::World{}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::rendering
