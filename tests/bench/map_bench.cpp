// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/map_writer.hpp"
#include "topoloc/map/node_index.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <unistd.h>

#include <benchmark/benchmark.h>

namespace {

using topoloc::RigidTransform;
using topoloc::map::Feature;
using topoloc::map::MapFile;
using topoloc::map::MapInfo;
using topoloc::map::MapWriter;
using topoloc::map::NodeDraft;
using topoloc::map::NodeIndex;

constexpr int kNodes = 100'000;
constexpr int kFeatures = 8;  ///< opening does not look at them

/// Nodes 5 m apart on a winding road: 500 km.
RigidTransform pose_of(int i) {
  const double s_m = 5.0 * i;
  const double heading_rad = 2.0 * std::sin(s_m / 900.0);
  RigidTransform T_world_cam;
  T_world_cam.R.col(2) = Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  T_world_cam.R.col(1) = -Eigen::Vector3d::UnitZ();
  T_world_cam.R.col(0) = T_world_cam.R.col(1).cross(T_world_cam.R.col(2));
  T_world_cam.p = {0.4 * s_m, 700.0 * std::sin(s_m / 900.0), 5.0 * std::sin(s_m / 5000.0)};
  return T_world_cam;
}

/// A map file that lives as long as the benchmarks.
class LargeMap {
 public:
  LargeMap()
      : path_(std::filesystem::temp_directory_path() /
              ("topoloc_bench_" + std::to_string(getpid()) + ".tmap")) {
    MapInfo info;
    info.camera = {640, 384, 450.0, 450.0, 319.5, 191.5};
    info.model = {"xfeat", 1, 64};
    MapWriter writer(path_, info);
    NodeDraft node;
    node.features.assign(kFeatures, Feature{{10.0F, 10.0F}, 5.0F, 0.1F, 0.5F});
    node.descriptors.assign(static_cast<std::size_t>(kFeatures * info.model.descriptor_dim), 1);
    for (int i = 0; i < kNodes; ++i) {
      node.time_ns = i + 1;
      node.T_world_cam = pose_of(i);
      writer.add(node);
    }
    writer.finish();
  }
  ~LargeMap() { std::filesystem::remove(path_); }
  LargeMap(const LargeMap&) = delete;
  LargeMap& operator=(const LargeMap&) = delete;

  static const std::filesystem::path& path() {
    static const LargeMap map;
    return map.path_;
  }

 private:
  std::filesystem::path path_;
};

/// Goal: 20 ms with the index.
void map_open_100k_nodes(benchmark::State& state) {
  const auto& path = LargeMap::path();
  for (auto _ : state) {
    const MapFile map(path);
    benchmark::DoNotOptimize(map.node_count());
  }
}
BENCHMARK(map_open_100k_nodes)->Unit(benchmark::kMillisecond);

void map_open_and_index_100k_nodes(benchmark::State& state) {
  const auto& path = LargeMap::path();
  for (auto _ : state) {
    const MapFile map(path);
    const NodeIndex index(map);
    benchmark::DoNotOptimize(&index);
  }
}
BENCHMARK(map_open_and_index_100k_nodes)->Unit(benchmark::kMillisecond);

/// Goal: 2 us.
void node_lookup(benchmark::State& state) {
  const MapFile map(LargeMap::path());
  const NodeIndex index(map);
  std::mt19937 random(1);
  std::uniform_int_distribution<int> any(0, kNodes - 1);
  std::array<RigidTransform, 1024> queries;
  for (RigidTransform& query : queries) {
    query = pose_of(any(random));
    query.p += Eigen::Vector3d(1.3, -0.9, 0.2);
  }
  std::array<std::uint32_t, 4> ids{};
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(index.nearest(queries[i++ % queries.size()],
                                           static_cast<int>(state.range(0)), 25.0, 0.8, ids));
  }
}
BENCHMARK(node_lookup)->Arg(1)->Arg(4);

void map_node_check_512_features(benchmark::State& state) {
  const auto path = std::filesystem::path(LargeMap::path()).replace_extension(".one.tmap");
  {
    MapInfo info;
    info.camera = {640, 384, 450.0, 450.0, 319.5, 191.5};
    info.model = {"xfeat", 1, 64};
    MapWriter writer(path, info);
    NodeDraft node;
    node.features.resize(512);
    node.descriptors.resize(std::size_t{512} * 64);
    writer.add(node);
    writer.finish();
  }
  const MapFile map(path);
  std::filesystem::remove(path);
  for (auto _ : state) {
    benchmark::DoNotOptimize(map.node_intact(0));
  }
}
BENCHMARK(map_node_check_512_features);

}  // namespace
