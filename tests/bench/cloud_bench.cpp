// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/render.hpp"

#include "support/peak_memory.hpp"
#include "support/ply_file.hpp"
#include "support/temporary_folder.hpp"

#include <cstdint>
#include <random>

#include <benchmark/benchmark.h>

namespace {

using topoloc::PinholeCamera;
using topoloc::RigidTransform;
using topoloc::mapping::CloudGrid;
using topoloc::mapping::CloudStorage;
using topoloc::mapping::PointCloud;

constexpr int kPointsPerKilometre = 7'000'000;
constexpr std::uint64_t kMegabyte = 1'000'000;

/// A street along x at UTM-like coordinates, 7 million points to the kilometre in no order within
/// 20 m: ground 24 m wide, facades 10 m high on both sides, a pole every 25 m. The first kilometre
/// of a longer street is the same.
template <typename Add>
void street(int kilometres, const Add& add) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  constexpr int kBlocks = 50;  // to the kilometre
  for (int block = 0; block < kilometres * kBlocks; ++block) {
    for (int i = 0; i < kPointsPerKilometre / kBlocks; ++i) {
      const double x = 20.0 * (block + unit(random));
      const double kind = unit(random);
      double y = 24.0 * unit(random) - 12.0;
      double z = 0.01 * unit(random);
      if (kind > 0.99) {
        const double angle = 6.28 * unit(random);
        const double pole_x = 25.0 * static_cast<int>(x / 25.0);
        add(pole_x + 0.1 * std::cos(angle), 7.0 + 0.1 * std::sin(angle), 8.0 * unit(random));
        continue;
      }
      if (kind > 0.55) {
        y = y > 0.0 ? 12.0 : -12.0;
        z = 10.0 * unit(random);
      }
      add(x, y, z);
    }
  }
}

const Eigen::Vector3d kOrigin_m{691'234.0, 4'334'567.0, 100.0};

PointCloud street_in_memory(int kilometres) {
  PointCloud cloud;
  cloud.origin_m = kOrigin_m;
  street(kilometres, [&](double x, double y, double z) {
    cloud.positions_m.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
    cloud.intensities.push_back(static_cast<float>(z));
  });
  return cloud;
}

/// One kilometre as a file, and a folder for scratch.
class StreetFile {
 public:
  StreetFile() {
    topoloc::testing::PlyFile ply(path(), kPointsPerKilometre);
    street(1, [&](double x, double y, double z) {
      ply.add(kOrigin_m.x() + x, kOrigin_m.y() + y, kOrigin_m.z() + z, z);
    });
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "street.ply"; }
  [[nodiscard]] CloudStorage storage(std::uint64_t megabytes) const {
    return {megabytes * kMegabyte, folder_ / ""};
  }
  static const StreetFile& get() {
    static const StreetFile file;
    return file;
  }

 private:
  topoloc::testing::TemporaryFolder folder_;
};

const PinholeCamera kWide{1248, 384, 721.5, 721.5, 609.5, 172.8};
const PinholeCamera kMatching{640, 384, 450.0, 450.0, 319.5, 191.5};

/// On the street, 1.6 m above the ground, looking along it.
RigidTransform camera_at(double x_m) {
  RigidTransform T_world_cam;
  T_world_cam.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_world_cam.p = kOrigin_m + Eigen::Vector3d(x_m, 0.0, 1.6);
  return T_world_cam;
}

void render_views(benchmark::State& state, const CloudGrid& grid, const PinholeCamera& camera) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(render(grid, camera, camera_at(500.0)));
  }
  state.counters["points_M"] = 1e-6 * static_cast<double>(grid.cloud().size());
  state.counters["coverage"] = render(grid, camera, camera_at(500.0)).coverage();
}

/// Arguments: width of the image [px], length of the street [km].
void render_street(benchmark::State& state) {
  const CloudGrid grid(street_in_memory(static_cast<int>(state.range(1))));
  render_views(state, grid, state.range(0) == kWide.width_px ? kWide : kMatching);
}
BENCHMARK(render_street)
    ->ArgNames({"px", "km"})
    ->Args({1248, 1})
    ->Args({1248, 4})
    ->Args({640, 1})
    ->Args({640, 4})
    ->Unit(benchmark::kMillisecond);

void render_street_from_disk(benchmark::State& state) {
  const StreetFile& file = StreetFile::get();
  const CloudGrid grid = CloudGrid::load(file.path(), file.storage(64));
  render_views(state, grid, state.range(0) == kWide.width_px ? kWide : kMatching);
}
BENCHMARK(render_street_from_disk)
    ->ArgName("px")
    ->Arg(1248)
    ->Arg(640)
    ->Unit(benchmark::kMillisecond);

void sort_7M_points(benchmark::State& state) {
  const PointCloud cloud = street_in_memory(1);
  for (auto _ : state) {
    const CloudGrid grid(cloud);
    benchmark::DoNotOptimize(grid.cells().data());
  }
}
BENCHMARK(sort_7M_points)->Unit(benchmark::kMillisecond);

/// Reading a binary PLY and sorting it. Argument: memory for the cloud [MB].
void load_7M_points(benchmark::State& state) {
  const StreetFile& file = StreetFile::get();
  const CloudStorage storage = file.storage(static_cast<std::uint64_t>(state.range(0)));
  for (auto _ : state) {
    const topoloc::testing::PeakMemory peak;
    const CloudGrid grid = CloudGrid::load(file.path(), storage);
    state.counters["peak_MB"] = static_cast<double>(peak.bytes()) / static_cast<double>(kMegabyte);
    state.counters["runs"] = static_cast<double>(grid.spilled_runs());
  }
}
BENCHMARK(load_7M_points)
    ->ArgName("MB")
    ->Arg(1000)
    ->Arg(64)
    ->Arg(16)
    ->Unit(benchmark::kMillisecond);

/// A drive along the whole street, a view every 5 m, with 64 MB for a cloud of 112 MB.
void drive_along_7M_points_on_disk(benchmark::State& state) {
  const StreetFile& file = StreetFile::get();
  for (auto _ : state) {
    const topoloc::testing::PeakMemory peak;
    const CloudGrid grid = CloudGrid::load(file.path(), file.storage(64));
    for (double x_m = 0.0; x_m < 1000.0; x_m += 5.0) {
      benchmark::DoNotOptimize(render(grid, kMatching, camera_at(x_m)));
    }
    state.counters["peak_MB"] = static_cast<double>(peak.bytes()) / static_cast<double>(kMegabyte);
  }
}
BENCHMARK(drive_along_7M_points_on_disk)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
