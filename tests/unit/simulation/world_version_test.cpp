// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/world_file.hpp"
#include "topoloc/world/world.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <xxhash.h>

namespace topoloc::simulation {
namespace {

/// Numbers of a world, one after the other, rounded: the last bit of a sine is the library's
/// affair.
class WorldPrint {
 public:
  template <typename Vector>
  void add(const Vector& numbers) {
    constexpr double kSteps = 1e4;  // 0.1 mm
    for (const double number : numbers.template cast<double>().reshaped()) {
      numbers_.push_back(std::llround(kSteps * number));
    }
  }
  void add(std::uint32_t number) { numbers_.push_back(number); }
  void add(const std::vector<world::Instance>& instances) {
    for (const world::Instance& instance : instances) {
      add(instance.mesh);
      add(instance.T_world_mesh.p);
      add(instance.T_world_mesh.R);
      add(Eigen::Vector<float, 1>(instance.scale));
      add(instance.seed);
    }
  }
  [[nodiscard]] std::string text() const {
    return fmt::format("{:016x}",
                       XXH3_64bits(numbers_.data(), numbers_.size() * sizeof(numbers_.front())));
  }

 private:
  std::vector<std::int64_t> numbers_;
};

std::string print_of(const world::World& world, const world::Visit& visit) {
  WorldPrint print;
  for (const world::Surface& surface : world.surfaces) {
    print.add(static_cast<std::uint32_t>(surface.material));
    print.add(surface.seed);
    print.add(Eigen::Vector4f(surface.parameters.data()));
  }
  for (const world::Mesh& mesh : world.meshes) {
    for (const world::Vertex& vertex : mesh.vertices) {
      print.add(vertex.position_m);
      print.add(vertex.uv_m);
    }
    for (const world::Triangle& triangle : mesh.triangles) {
      print.add(triangle.surface);
      for (const std::uint32_t vertex : triangle.vertices) {
        print.add(vertex);
      }
    }
  }
  print.add(world.instances);
  for (const world::Lamp& lamp : world.lamps) {
    print.add(lamp.position_m);
    print.add(lamp.direction);
    print.add(Eigen::Vector2d(lamp.intensity, lamp.cos_cone));
    print.add(lamp.always_on ? 1U : 0U);
  }
  print.add(visit.parked());
  print.add(visit.moving(5.0, 60.0, world.lanes(60.0).front().left_m));
  return print.text();
}

struct Print {
  world::Scenario scenario;
  const char* text;
};

class WorldVersion : public ::testing::TestWithParam<Print> {};

// One version of the worlds, one world for a seed: whatever compiler made it, and with whatever
// options. A world that is changed needs another kWorldVersion, and then other prints here. (What
// surfaces look like is not in the prints: rounded or not, it is the last bits of many sums.)
TEST_P(WorldVersion, MeansTheSameWorldEverywhere) {
  ASSERT_EQ(kWorldVersion, 5);
  const world::World world = world::make_world({GetParam().scenario, 5, 150.0});
  EXPECT_EQ(print_of(world, {world, {6, 0.6, 20.0}}), GetParam().text);
}

INSTANTIATE_TEST_SUITE_P(All, WorldVersion,
                         ::testing::Values(Print{world::Scenario::kTown, "283636a291e7fa3e"},
                                           Print{world::Scenario::kHighway, "cbcb9782357e30d9"},
                                           Print{world::Scenario::kTunnel, "04afe9ecd13ed50f"},
                                           Print{world::Scenario::kMixed, "bec5cc6954bb6de3"}));

}  // namespace
}  // namespace topoloc::simulation
