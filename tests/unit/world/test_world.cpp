// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/world.hpp"

#include "world/site.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::world {
namespace {

bool same(const World& a, const World& b) {
  if (a.meshes.size() != b.meshes.size() || a.surfaces.size() != b.surfaces.size() ||
      a.instances.size() != b.instances.size() || a.lamps.size() != b.lamps.size()) {
    return false;
  }
  for (std::size_t m = 0; m < a.meshes.size(); ++m) {
    if (a.meshes[m].vertices.size() != b.meshes[m].vertices.size() ||
        a.meshes[m].triangles.size() != b.meshes[m].triangles.size()) {
      return false;
    }
    for (std::size_t i = 0; i < a.meshes[m].vertices.size(); ++i) {
      if (a.meshes[m].vertices[i].position_m != b.meshes[m].vertices[i].position_m ||
          a.meshes[m].vertices[i].uv_m != b.meshes[m].vertices[i].uv_m) {
        return false;
      }
    }
  }
  for (std::size_t i = 0; i < a.instances.size(); ++i) {
    if (a.instances[i].mesh != b.instances[i].mesh || a.instances[i].seed != b.instances[i].seed ||
        a.instances[i].T_world_mesh.p != b.instances[i].T_world_mesh.p) {
      return false;
    }
  }
  return true;
}

/// Tells which points stand in the way of the vehicle: over its lane, between the road and 3.5 m.
class Corridor {
 public:
  explicit Corridor(const World& world) : world_(world), site_(world.route, 0.0, 0.0) {}

  [[nodiscard]] bool near(const Eigen::Vector3d& p) const {
    constexpr double kReach_m = 25.0;  // no tree is wider
    return site_.nearest(p.head<2>()).distance_m < kReach_m;
  }
  [[nodiscard]] bool blocks(const Eigen::Vector3d& p) const {
    constexpr double kLow_m = 0.3;
    constexpr double kHigh_m = 3.5;
    constexpr double kHalf_m = 1.35;  // of a car with its mirrors, and some room
    const Site::Nearest nearest = site_.nearest(p.head<2>());
    if (nearest.along_m < 0.0 || nearest.along_m > world_.route.length_m() ||
        nearest.distance_m > 14.0) {
      return false;
    }
    const Eigen::Vector3d local = world_.route.T_world_road(nearest.along_m).inverse() * p;
    const double lane = world_.lanes(nearest.along_m).front().left_m;
    return std::abs(local.y() - lane) < kHalf_m && local.z() > kLow_m && local.z() < kHigh_m;
  }

 private:
  const World& world_;
  Site site_;
};

class MadeWorld : public testing::TestWithParam<Scenario> {};

TEST_P(MadeWorld, IsTheSameAgain) {
  const WorldSpec spec{GetParam(), 3, 300.0};
  EXPECT_TRUE(same(make_world(spec), make_world(spec)));
}

TEST_P(MadeWorld, DiffersWithTheSeed) {
  EXPECT_FALSE(same(make_world({GetParam(), 3, 300.0}), make_world({GetParam(), 4, 300.0})));
}

TEST_P(MadeWorld, LeavesTheLaneFree) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const World world = make_world({GetParam(), seed, 400.0});
    const Corridor corridor(world);
    int blocked = 0;
    const auto check = [&](const Eigen::Vector3d& p, const char* what) {
      if (corridor.blocks(p) && ++blocked <= 5) {
        ADD_FAILURE() << what << " at " << p.transpose() << ", seed " << seed;
      }
    };
    const Mesh& unique = world.meshes.front();
    for (const Triangle& triangle : unique.triangles) {
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const std::uint32_t v : triangle.vertices) {
        const Eigen::Vector3d p = unique.vertices[v].position_m.cast<double>();
        check(p, "vertex");
        middle += p / 3.0;
      }
      check(middle, "triangle");
    }
    for (const Instance& instance : world.instances) {
      if (!corridor.near(instance.T_world_mesh.p)) {
        continue;
      }
      for (const Vertex& vertex : world.meshes[instance.mesh].vertices) {
        check(instance.T_world_mesh * (instance.scale * vertex.position_m.cast<double>()),
              "instance");
      }
    }
  }
}

TEST_P(MadeWorld, HasIndicesInRangeAndFiniteVertices) {
  const World world = make_world({GetParam(), 2, 400.0});
  for (const Mesh& mesh : world.meshes) {
    for (const Triangle& triangle : mesh.triangles) {
      ASSERT_LT(triangle.surface, world.surfaces.size());
      for (const std::uint32_t v : triangle.vertices) {
        ASSERT_LT(v, mesh.vertices.size());
      }
    }
    for (const Vertex& vertex : mesh.vertices) {
      ASSERT_TRUE(vertex.position_m.allFinite() && vertex.uv_m.allFinite());
    }
  }
  for (const Instance& instance : world.instances) {
    ASSERT_LT(instance.mesh, world.meshes.size());
    ASSERT_NEAR(instance.T_world_mesh.R.determinant(), 1.0, 1e-9);
    ASSERT_GT(instance.scale, 0.0F);
  }
}

TEST_P(MadeWorld, FitsIntoMemory) {
  const World world = make_world({GetParam(), 2, 1000.0});
  EXPECT_LT(world.meshes.front().triangles.size(), 1500000U);
  EXPECT_GT(world.meshes.front().triangles.size(), 50000U);
  std::size_t prototypes = 0;
  for (std::size_t m = 1; m < world.meshes.size(); ++m) {
    prototypes += world.meshes[m].triangles.size();
  }
  EXPECT_LT(prototypes, 200000U);
  EXPECT_FALSE(world.car_meshes.empty());
}

TEST_P(MadeWorld, LanesAreSmooth) {
  const World world = make_world({GetParam(), 5, 400.0});
  constexpr double kStep_m = 1.0;
  double before = world.lanes(-20.0).front().left_m;
  double slope = 0.0;
  for (double s = -20.0 + kStep_m; s < 420.0; s += kStep_m) {
    const std::vector<Lane> lanes = world.lanes(s);
    ASSERT_GE(lanes.size(), 2U);
    ASSERT_TRUE(lanes.front().forward);
    for (std::size_t i = 1; i < lanes.size(); ++i) {
      ASSERT_GT(lanes[i].left_m, lanes[i - 1].left_m + 2.5) << "at " << s;
    }
    const double left = lanes.front().left_m;
    ASSERT_LT(std::abs(left - before), 0.35 * kStep_m) << "at " << s;
    ASSERT_LT(std::abs(left - before - slope), 0.03) << "kink at " << s;
    slope = left - before;
    before = left;
  }
}

TEST_P(MadeWorld, BumpsAreSmallAndSmooth) {
  const World world = make_world({GetParam(), 6, 1000.0});
  constexpr double kStep_m = 0.01;
  double highest = 0.0;
  double squares = 0.0;
  int count = 0;
  for (const double left : {-2.4, -0.9}) {
    double before = world.bump_m(0.0, left);
    double slope = 0.0;
    for (double s = kStep_m; s < 1000.0; s += kStep_m) {
      const double bump = world.bump_m(s, left);
      ASSERT_LT(std::abs(bump - before), 0.1 * kStep_m) << "at " << s;
      if (count > 0 && s > 2.0 * kStep_m) {
        ASSERT_LT(std::abs(bump - before - slope), 0.004 * kStep_m) << "kink at " << s;
      }
      slope = bump - before;
      before = bump;
      highest = std::max(highest, std::abs(bump));
      squares += bump * bump;
      ++count;
    }
  }
  EXPECT_LT(highest, 0.12);
  const double rms = std::sqrt(squares / count);
  EXPECT_GT(rms, 0.002);
  EXPECT_LT(rms, 0.02);
}

INSTANTIATE_TEST_SUITE_P(All, MadeWorld,
                         testing::Values(Scenario::kTown, Scenario::kHighway, Scenario::kTunnel,
                                         Scenario::kMixed));

TEST(World, NamesScenarios) {
  for (const Scenario scenario :
       {Scenario::kTown, Scenario::kHighway, Scenario::kTunnel, Scenario::kMixed}) {
    EXPECT_EQ(scenario_of(name(scenario)), scenario);
  }
  try {
    scenario_of("moon");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::strstr(error.what(), "highway"), nullptr);
  }
}

TEST(World, HasLampsInTownAndTunnel) {
  const World town = make_world({Scenario::kTown, 1, 500.0});
  EXPECT_GT(town.lamps.size(), 20U);
  EXPECT_FALSE(town.lamps.front().always_on);
  const World tunnel = make_world({Scenario::kTunnel, 1, 500.0});
  const auto lit = std::count_if(tunnel.lamps.begin(), tunnel.lamps.end(),
                                 [](const Lamp& lamp) { return lamp.always_on; });
  EXPECT_GT(lit, 50);
}

/// Which way the letters of a triangle run on.
Eigen::Vector3d reading_direction(const Mesh& mesh, const Triangle& triangle) {
  Eigen::Matrix<double, 3, 2> sides;
  Eigen::Matrix2d uv;
  const Vertex& from = mesh.vertices[triangle.vertices[0]];
  for (int i = 0; i < 2; ++i) {
    const Vertex& to = mesh.vertices[triangle.vertices[static_cast<std::size_t>(i) + 1]];
    sides.col(i) = (to.position_m - from.position_m).cast<double>();
    uv.col(i) = (to.uv_m - from.uv_m).cast<double>();
  }
  return (sides * uv.inverse()).col(0);
}

// Houses on one side of a street are built in a mirrored frame.
TEST(World, LettersOfShopsReadFromLeftToRight) {
  const World world = make_world({Scenario::kTown, 1, 400.0});
  const Mesh& mesh = world.meshes.front();
  const Site site(world.route, 0.0, 0.0);
  int left = 0;
  int right = 0;
  for (const Triangle& triangle : mesh.triangles) {
    if (world.surfaces[triangle.surface].material != Material::kShopFront) {
      continue;
    }
    const Eigen::Vector3d p = mesh.vertices[triangle.vertices[0]].position_m.cast<double>();
    const double along_m = site.nearest(p.head<2>()).along_m;
    if (along_m < 0.0 || along_m > world.route.length_m()) {
      continue;
    }
    const double side = (world.route.T_world_road(along_m).inverse() * p).y();
    const Eigen::Vector3d forward = world.route.T_world_road(along_m).R.col(0);
    // Who looks to the left from the road has the way ahead on the right hand.
    const double ahead = reading_direction(mesh, triangle).dot(forward);
    if (std::abs(ahead) < 0.7 || std::abs(side) > 20.0) {
      continue;  // round a corner
    }
    EXPECT_EQ(ahead > 0.0, side > 0.0) << "at " << p.transpose();
    (side > 0.0 ? left : right) += 1;
  }
  EXPECT_GT(left, 4);
  EXPECT_GT(right, 4);
}

double flux_lm(const Lamp& lamp) {
  constexpr double kCandela = 1e5;  // of Lamp::intensity
  // The rim of the cone is soft: half of the light of its outer part.
  const double cosine = lamp.cos_cone + 0.15 * (1.0 - lamp.cos_cone);
  return kCandela * lamp.intensity * 2.0 * std::numbers::pi * (1.0 - cosine);
}

TEST(World, LampsGiveAsMuchLightAsRealOnes) {
  for (const Lamp& lamp : make_world({Scenario::kTown, 1, 500.0}).lamps) {
    EXPECT_GT(flux_lm(lamp), 4000.0);
    EXPECT_LT(flux_lm(lamp), 8000.0);
  }
  std::vector<double> in_tunnel;
  for (const Lamp& lamp : make_world({Scenario::kTunnel, 1, 500.0}).lamps) {
    if (lamp.always_on) {
      in_tunnel.push_back(flux_lm(lamp));
      EXPECT_GT(in_tunnel.back(), 8000.0);
      EXPECT_LT(in_tunnel.back(), 110'000.0);  // at the portals a row of some
    }
  }
  std::sort(in_tunnel.begin(), in_tunnel.end());
  EXPECT_LT(in_tunnel[in_tunnel.size() / 2], 12'000.0);
}

}  // namespace
}  // namespace topoloc::world
