// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/cloud_grid.hpp"

#include "topoloc/mapping/render.hpp"

#include "support/peak_memory.hpp"
#include "support/ply_file.hpp"
#include "support/temporary_folder.hpp"
#include "unit/mapping/synthetic_cloud.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>
#include <limits>
#include <random>
#include <sys/resource.h>
#include <thread>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

namespace topoloc::mapping {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::uint64_t kBytesAPoint = 36;  // what CloudStorage states

/// A street along z (the camera's axis) and beyond its end, in no order, with coordinates on the
/// borders of cells.
PointCloud street(int points) {
  PointCloud cloud;
  cloud.origin_m = {691'234.0, 4'334'567.0, 112.0};
  cloud.has_intensity = true;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> along(-40.0F, 120.0F);
  std::uniform_real_distribution<float> across(-12.0F, 12.0F);
  for (int i = 0; i < points; ++i) {
    const float snapped = std::round(across(random) / 4.0F) * 4.0F;
    cloud.positions_m.emplace_back(i % 3 == 0 ? snapped : across(random),
                                   i % 2 == 0 ? 1.6F : across(random), along(random));
    cloud.intensities.push_back(static_cast<float>(i));
  }
  return cloud;
}

template <typename T>
bool same_bytes(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

void expect_same(const CloudGrid& a, const CloudGrid& b) {
  EXPECT_TRUE(same_bytes(a.cloud().positions_m, b.cloud().positions_m));
  EXPECT_TRUE(same_bytes(a.cloud().intensities, b.cloud().intensities));
  EXPECT_TRUE(same_bytes(a.cells(), b.cells()));
  EXPECT_EQ(a.cloud().origin_m, b.cloud().origin_m);
  EXPECT_EQ(a.cloud().has_intensity, b.cloud().has_intensity);
  EXPECT_TRUE(a.cloud().box_world.isApprox(b.cloud().box_world));
}

RigidTransform camera_at(const CloudGrid& grid, double z_m) {
  return {Eigen::Matrix3d::Identity(), grid.cloud().origin_m + Eigen::Vector3d(0.0, 0.0, z_m)};
}

class CloudOnDisk : public ::testing::Test {
 protected:
  [[nodiscard]] CloudStorage storage(std::uint64_t bytes) const { return {bytes, scratch()}; }
  /// A folder of its own, so that anything left behind shows.
  [[nodiscard]] std::filesystem::path scratch() const {
    const auto folder = folder_ / "scratch";
    std::filesystem::create_directories(folder);
    return folder;
  }
  /// A cloud file of `points` random points, as street() places them.
  [[nodiscard]] std::filesystem::path file(int points) const {
    const auto path = folder_ / "street.ply";
    const PointCloud cloud = street(points);
    testing::PlyFile ply(path, cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d p = cloud.position_world(i);
      ply.add(p.x(), p.y(), p.z(), static_cast<double>(cloud.intensities[i]));
    }
    return path;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(CloudOnDisk, GivesTheSamePointsCellsAndViewsWhateverTheMemory) {
  const PointCloud cloud = street(30'000);
  const CloudGrid in_memory(cloud);
  EXPECT_EQ(in_memory.spilled_runs(), 0U);
  const RenderedView view = render(in_memory, kCamera, camera_at(in_memory, 3.0));
  EXPECT_GT(view.coverage(), 0.05);
  for (const std::uint64_t bytes : {600'000U, 64'000U, 3'000U}) {
    const CloudGrid on_disk(cloud, storage(bytes));
    EXPECT_GT(on_disk.spilled_runs(), 1U);
    expect_same(in_memory, on_disk);
    const RenderedView same = render(on_disk, kCamera, camera_at(on_disk, 3.0));
    EXPECT_EQ(view.point, same.point);
    EXPECT_EQ(view.depth_m, same.depth_m);
    EXPECT_EQ(view.intensity, same.intensity);
  }
}

TEST_F(CloudOnDisk, FileGivesTheSameWhateverTheMemory) {
  const auto path = file(20'000);
  const CloudGrid in_memory = CloudGrid::load(path, storage(1U << 30U));
  const CloudGrid on_disk = CloudGrid::load(path, storage(50'000));
  EXPECT_EQ(in_memory.spilled_runs(), 0U);
  EXPECT_GT(on_disk.spilled_runs(), 10U);
  expect_same(in_memory, on_disk);
  expect_same(in_memory, CloudGrid(load_point_cloud(path)));
}

TEST_F(CloudOnDisk, SortingHoldsNoMoreThanItIsGiven) {
  constexpr std::uint64_t kPoints = 100'000;
  const PointCloud cloud = street(kPoints);
  for (const std::uint64_t bytes : {2'000'000U, 400'000U}) {
    const CloudGrid grid(cloud, storage(bytes));
    EXPECT_LE(grid.peak_bytes(), bytes);
    EXPECT_GE(grid.spilled_runs(), kPoints * kBytesAPoint / bytes);
  }
  const CloudGrid grid(cloud, storage(kPoints * kBytesAPoint + 1'000'000));
  EXPECT_EQ(grid.spilled_runs(), 0U);
}

TEST_F(CloudOnDisk, ManyCellsCountAsMemoryToo) {
  // Every point in a cell of its own: the table of cells outweighs the points.
  PointCloud cloud;
  for (int i = 0; i < 20'000; ++i) {
    cloud.positions_m.emplace_back(8.0F * static_cast<float>(i % 200),
                                   8.0F * static_cast<float>(i / 200), 0.0F);
    cloud.intensities.push_back(0.0F);
  }
  const CloudGrid grid(cloud, storage(20'000 * kBytesAPoint));
  EXPECT_EQ(grid.cells().size(), 20'000U);
  EXPECT_GT(grid.spilled_runs(), 1U);
  EXPECT_LE(grid.peak_bytes(), 20'000 * kBytesAPoint);
}

TEST_F(CloudOnDisk, ProcessStaysSmallWhileALargeCloudIsLoadedAndSeen) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers keep freed memory";
  }
  constexpr std::size_t kPoints = 3'000'000;
  constexpr std::uint64_t kBudget = 8'000'000;
  const auto path = folder_ / "long.ply";
  {
    testing::PlyFile ply(path, kPoints);
    for (std::size_t i = 0; i < kPoints; ++i) {  // a ribbon 3 km long
      ply.add(0.001 * static_cast<double>(i % 9000) - 4.5, 1.6, 0.001 * static_cast<double>(i),
              1.0);
    }
  }
  const testing::PeakMemory peak;
  const CloudGrid grid = CloudGrid::load(path, storage(kBudget));
  ASSERT_EQ(grid.cloud().size(), kPoints);
  EXPECT_LT(peak.bytes(), kBudget + 4'000'000)
      << "in memory it would be " << kPoints * kBytesAPoint;
  for (double z_m = 0.0; z_m < 3000.0; z_m += 20.0) {
    EXPECT_GT(render(grid, kCamera, camera_at(grid, z_m)).coverage(), 0.0);
  }
  // The file has 48 MB; a view looks at 1.4 MB of it.
  EXPECT_LT(peak.bytes(), kBudget + 8'000'000);
}

TEST_F(CloudOnDisk, ViewsOfManyThreadsAgreeWhilePagesAreLetGo) {
  const CloudGrid grid(street(30'000), storage(64'000));
  const RenderedView expected = render(grid, kCamera, camera_at(grid, 0.0));
  std::array<bool, 3> same{};
  {
    std::vector<std::jthread> threads;
    for (bool& mine : same) {
      threads.emplace_back([&grid, &expected, &mine] {
        mine = true;
        for (int i = 0; i < 20; ++i) {
          const RenderedView view = render(grid, kCamera, camera_at(grid, 0.0));
          mine = mine && view.point == expected.point && view.depth_m == expected.depth_m;
        }
      });
    }
  }
  EXPECT_THAT(same, ::testing::Each(true));
}

TEST_F(CloudOnDisk, LeavesNothingInTheScratchFolder) {
  {
    const CloudGrid grid(street(5'000), storage(20'000));
    EXPECT_GT(grid.spilled_runs(), 0U);
    EXPECT_TRUE(std::filesystem::is_empty(scratch()));  // not even while it is in use
  }
  EXPECT_TRUE(std::filesystem::is_empty(scratch()));
}

TEST_F(CloudOnDisk, TruncatedCloudIsAnErrorAfterItsFirstPartsWentToDisk) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3001\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  for (int i = 0; i < 3000; ++i) {
    text += std::to_string(i) + " 0 0\n";
  }
  const auto path = folder_.with("cut.ply", text);
  EXPECT_THAT([&] { CloudGrid::load(path, storage(10'000)); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("cut.ply"), HasSubstr("ends after 3000 of 3001 points"))));
  EXPECT_TRUE(std::filesystem::is_empty(scratch()));
}

TEST_F(CloudOnDisk, UnusableScratchFolderIsAnErrorThatNamesIt) {
  const PointCloud cloud = street(1000);
  const auto expect_complaint = [&](const std::filesystem::path& scratch) {
    EXPECT_THAT(
        [&] {
          CloudGrid(cloud, {10'000, scratch});
        },
        ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(scratch.string()),
                                                HasSubstr("cannot be created"),
                                                HasSubstr("allow the cloud more memory"))));
  };
  expect_complaint(folder_ / "nowhere");
  expect_complaint(folder_.with("file", ""));
  EXPECT_EQ(CloudGrid(cloud, {1'000'000, folder_ / "nowhere"}).spilled_runs(), 0U);
}

TEST_F(CloudOnDisk, FullDiskIsAnErrorThatSaysWhatToDo) {
  const PointCloud cloud = street(20'000);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  // 16 bytes a point are needed: no room for the runs, or for what they are merged into (which has
  // its cells, too).
  for (const rlim_t room : {rlim_t{100'000}, rlim_t{320'000}}) {
    const rlimit small{room, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THAT([&] { CloudGrid(cloud, storage(50'000)); },
                ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(scratch().string()),
                                                        HasSubstr("cannot be written"),
                                                        HasSubstr("make room"))));
    ::setrlimit(RLIMIT_FSIZE, &before);
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(std::filesystem::is_empty(scratch()));
}

TEST_F(CloudOnDisk, CountsAndLeavesOutPointsThatAreNotFinite) {
  const auto path = folder_ / "nan.ply";
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  {
    testing::PlyFile ply(path, 3000);
    for (int i = 0; i < 3000; ++i) {
      ply.add(i, i % 3 == 1 ? kNan : 0.0, i % 3 == 2 ? 1e9 : 0.0, i);
    }
  }
  const CloudGrid grid = CloudGrid::load(path, storage(10'000));
  EXPECT_GT(grid.spilled_runs(), 1U);
  EXPECT_EQ(grid.cloud().size(), 1000U);
  EXPECT_EQ(grid.cloud().rejected_not_finite, 1000U);
  EXPECT_EQ(grid.cloud().rejected_too_far, 1000U);
  EXPECT_EQ(grid.cloud().rejected(), 2000U);
}

TEST_F(CloudOnDisk, KeepsMillimetresInProjectedCoordinates) {
  const auto path = folder_ / "utm.ply";
  {
    testing::PlyFile ply(path, 2000);
    for (int i = 0; i < 2000; ++i) {
      ply.add(691'234.567 + i, 4'334'567.891 - 0.25 * i, 112.345, i);
    }
  }
  const CloudGrid grid = CloudGrid::load(path, storage(10'000));
  EXPECT_GT(grid.spilled_runs(), 1U);
  for (std::size_t k = 0; k < grid.cloud().size(); ++k) {
    const auto i = static_cast<double>(grid.cloud().intensities[k]);
    const Eigen::Vector3d expected{691'234.567 + i, 4'334'567.891 - 0.25 * i, 112.345};
    EXPECT_LT((grid.cloud().position_world(k) - expected).norm(), 2e-4);
  }
  EXPECT_TRUE(grid.cloud().box_world.min().isApprox(
      Eigen::Vector3d(691'234.567, 4'334'567.891 - 0.25 * 1999, 112.345), 1e-9));
}

TEST(CloudCells, PointsOnABorderBelongToTheCellThatBeginsThere) {
  const auto cell_of = [](float x) {
    PointCloud cloud;
    cloud.positions_m.emplace_back(x, 0.0F, 0.0F);
    cloud.intensities.push_back(0.0F);
    return CloudGrid(std::move(cloud)).cells()[0].x;
  };
  EXPECT_EQ(cell_of(0.0F), 0);
  EXPECT_EQ(cell_of(-0.0F), 0);
  EXPECT_EQ(cell_of(8.0F), 1);
  EXPECT_EQ(cell_of(std::nextafter(8.0F, 0.0F)), 0);
  EXPECT_EQ(cell_of(-8.0F), -1);
  EXPECT_EQ(cell_of(std::nextafter(-8.0F, -9.0F)), -2);
  EXPECT_EQ(cell_of(-1e-6F), -1);
  EXPECT_EQ(cell_of(100'000.0F), 12'500);
  EXPECT_EQ(cell_of(-100'000.0F), -12'500);
}

TEST(CloudCells, AreSortedAndHoldTheirPoints) {
  const CloudGrid grid(street(5'000));
  const auto key = [](const CloudGrid::Cell& c) { return std::tuple(c.x, c.y, c.z); };
  std::uint32_t next = 0;
  for (std::size_t k = 0; k < grid.cells().size(); ++k) {
    const CloudGrid::Cell& cell = grid.cells()[k];
    EXPECT_TRUE(k == 0 || key(grid.cells()[k - 1]) < key(cell));
    EXPECT_EQ(cell.begin, next);
    EXPECT_GT(cell.end, cell.begin);
    next = cell.end;
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const Eigen::Vector3i index =
          (grid.cloud().positions_m[i].cast<double>() / 8.0).array().floor().cast<int>();
      EXPECT_EQ(index, Eigen::Vector3i(cell.x, cell.y, cell.z));
      // Intensities were numbered: the order within a cell is that of the file.
      EXPECT_TRUE(i == cell.begin || grid.cloud().intensities[i - 1] < grid.cloud().intensities[i]);
    }
  }
  EXPECT_EQ(next, grid.cloud().size());
}

TEST(CloudCells, RefusesPositionsThatNoCellHolds) {
  for (const float x : {std::numeric_limits<float>::quiet_NaN(), 100'100.0F,
                        -std::numeric_limits<float>::infinity()}) {
    PointCloud cloud;
    cloud.positions_m.emplace_back(0.0F, x, 0.0F);
    cloud.intensities.push_back(0.0F);
    EXPECT_THROW(CloudGrid(std::move(cloud)), std::invalid_argument);
  }
}

TEST_F(CloudOnDisk, SpacingIsThatOfNeighboursAndNeedsNoMemory) {
  PointCloud cloud;
  for (int i = 0; i < 40'000; ++i) {
    cloud.positions_m.emplace_back(0.05F * static_cast<float>(i % 200),
                                   0.05F * static_cast<float>(i / 200), 2.0F);
    cloud.intensities.push_back(0.0F);
  }
  EXPECT_NEAR(CloudGrid(cloud).median_spacing_m(), 0.05, 1e-5);
  EXPECT_NEAR(CloudGrid(cloud, storage(100'000)).median_spacing_m(), 0.05, 1e-5);
  cloud.positions_m.resize(1);
  cloud.intensities.resize(1);
  EXPECT_EQ(CloudGrid(cloud).median_spacing_m(), 0.0);
  EXPECT_EQ(CloudGrid(PointCloud{}).median_spacing_m(), 0.0);
}

TEST_F(CloudOnDisk, MorePointsThanAnIndexCanTellApartIsAnError) {
  // A file without blocks on disk, but of the right size.
  constexpr std::uint64_t kPoints = 4'294'967'295;
  const auto path =
      folder_.with("huge.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH " +
                                   std::to_string(kPoints) + "\nHEIGHT 1\nPOINTS " +
                                   std::to_string(kPoints) + "\nDATA binary\n");
  std::filesystem::resize_file(path, 12 * kPoints + 1000);
  EXPECT_THAT([&] { CloudGrid::load(path, storage(1'000'000)); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("huge.pcd"), HasSubstr("more than 2^32 - 2 points"))));
}

}  // namespace
}  // namespace topoloc::mapping
