// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/cloud_grid.hpp"

#include "mapping/cell_sorter.hpp"
#include "mapping/cloud_reader.hpp"
#include "mapping/sorted_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

namespace topoloc::mapping {
namespace {

using Key = std::tuple<std::int32_t, std::int32_t, std::int32_t>;

Key key_of(const CloudGrid::Cell& cell) { return {cell.x, cell.y, cell.z}; }

/// The four side planes of the camera's frustum: inward unit normals in camera axes, all through
/// the camera centre. Half a pixel wider than the pixel centres.
std::array<Eigen::Vector3d, 4> side_planes(const PinholeCamera& camera) {
  const Eigen::Vector3d top_left = camera.ray({-0.5, -0.5});
  const Eigen::Vector3d bottom_right = camera.ray({camera.width_px - 0.5, camera.height_px - 0.5});
  return {Eigen::Vector3d(1.0, 0.0, -top_left.x()).normalized(),
          Eigen::Vector3d(-1.0, 0.0, bottom_right.x()).normalized(),
          Eigen::Vector3d(0.0, 1.0, -top_left.y()).normalized(),
          Eigen::Vector3d(0.0, -1.0, bottom_right.y()).normalized()};
}

/// Hands the points of a file to a sorter.
class SortingSink : public PointSink {
 public:
  SortingSink(std::filesystem::path path, const CloudStorage& storage)
      : path_(std::move(path)), sorter_(storage) {}
  void expect(std::uint64_t points) override {
    try {
      sorter_.expect(points);
    } catch (const std::length_error& error) {
      fail(path_, error.what());
    }
  }
  CellSorter& sorter() { return sorter_; }

 protected:
  void take(const Eigen::Vector3f& position_m, float intensity) override {
    sorter_.add(position_m, intensity);
  }

 private:
  std::filesystem::path path_;
  CellSorter sorter_;
};

/// Takes the points out of the cloud.
SortedPoints sort_cloud(PointCloud& cloud, const CloudStorage& storage) {
  CellSorter sorter(storage);
  sorter.expect(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    // Also false for NaN, which a norm may lose.
    if (!(cloud.positions_m[i].array().abs() <= static_cast<float>(kMaxExtent_m)).all()) {
      throw std::invalid_argument("point " + std::to_string(i) +
                                  " of the cloud is not finite, or more than 100 km off");
    }
    sorter.add(cloud.positions_m[i], cloud.intensities[i]);
  }
  cloud.positions_m = {};  // before their sorted copy is made
  cloud.intensities = {};
  return sorter.finish();
}

}  // namespace

CloudGrid::CloudGrid(CloudInfo info, SortedPoints points)
    : points_(std::make_unique<const SortedPoints>(std::move(points))),
      cloud_{std::move(info), points_->positions_m, points_->intensities, {}} {
  const auto corner = [&](const Eigen::Vector3f& corner_m) -> Eigen::Vector3d {
    return cloud_.origin_m + corner_m.cast<double>();
  };
  if (!points_->box_m.isEmpty()) {
    cloud_.box_world = {corner(points_->box_m.min()), corner(points_->box_m.max())};
  }
}

CloudGrid::CloudGrid(CloudGrid&&) noexcept = default;
CloudGrid& CloudGrid::operator=(CloudGrid&&) noexcept = default;
CloudGrid::~CloudGrid() = default;

CloudGrid::CloudGrid(PointCloud cloud, const CloudStorage& storage)
    : CloudGrid(static_cast<const CloudInfo&>(cloud), sort_cloud(cloud, storage)) {}

CloudGrid CloudGrid::load(const std::filesystem::path& path, const CloudStorage& storage,
                          const Progress& progress) {
  constexpr double kReadingShare = 0.8;  // of the time, roughly; the rest is sorting
  const auto part = [&](double from, double to) -> Progress {
    if (!progress) {
      return {};
    }
    return [&progress, from, to](double fraction) { progress(from + fraction * (to - from)); };
  };
  SortingSink sink(path, storage);
  read_points(path, sink, part(0.0, kReadingShare));
  CloudGrid grid(std::move(sink.info()), sink.sorter().finish(part(kReadingShare, 1.0)));
  if (progress) {
    progress(1.0);
  }
  return grid;
}

std::span<const CloudGrid::Cell> CloudGrid::cells() const { return points_->cells; }

std::size_t CloudGrid::spilled_runs() const { return points_->spilled_runs; }

std::uint64_t CloudGrid::peak_bytes() const { return points_->peak_bytes; }

std::vector<CloudGrid::Cell> CloudGrid::cells_in_view(const PinholeCamera& camera,
                                                      const RigidTransform& T_world_cam,
                                                      double max_depth_m) const {
  const Eigen::Vector3d centre_m = T_world_cam.p - cloud_.origin_m;
  std::vector<Cell> seen;
  if (!(centre_m.array().abs() < 2.0 * kMaxExtent_m).all()) {
    return seen;  // also NaN
  }
  // Bounding box of the frustum: camera centre and the four corners at the largest depth.
  Eigen::AlignedBox3d box(centre_m);
  for (const double u_px : {-0.5, camera.width_px - 0.5}) {
    for (const double v_px : {-0.5, camera.height_px - 0.5}) {
      box.extend(centre_m + T_world_cam.R * (max_depth_m * camera.ray({u_px, v_px})));
    }
  }
  const Eigen::Vector3i first = (box.min() / kCellSize_m).array().floor().cast<int>();
  const Eigen::Vector3i last = (box.max() / kCellSize_m).array().floor().cast<int>();
  const auto planes = side_planes(camera);
  const double cell_radius_m = 0.5 * std::sqrt(3.0) * kCellSize_m;
  const auto in_frustum = [&](const Cell& cell) {
    const Eigen::Vector3d middle_m =
        kCellSize_m * (Eigen::Vector3d(cell.x, cell.y, cell.z).array() + 0.5);
    const Eigen::Vector3d middle_cam = T_world_cam.R.transpose() * (middle_m - centre_m);
    return middle_cam.z() > -cell_radius_m && middle_cam.z() < max_depth_m + cell_radius_m &&
           std::all_of(planes.begin(), planes.end(), [&](const Eigen::Vector3d& normal) {
             return normal.dot(middle_cam) > -cell_radius_m;
           });
  };
  const std::span<const Cell> all = cells();
  std::uint64_t points = 0;
  for (int x = first.x(); x <= last.x(); ++x) {
    for (int y = first.y(); y <= last.y(); ++y) {
      auto cell = std::lower_bound(
          all.begin(), all.end(), Key{x, y, first.z()},
          [](const Cell& candidate, const Key& key) { return key_of(candidate) < key; });
      for (; cell != all.end() && key_of(*cell) <= Key{x, y, last.z()}; ++cell) {
        if (in_frustum(*cell)) {
          seen.push_back(*cell);
          points += cell->end - cell->begin;
        }
      }
    }
  }
  about_to_read(points);
  return seen;
}

void CloudGrid::about_to_read(std::uint64_t points) const {
  if (const auto* mapping = std::get_if<std::unique_ptr<FileMapping>>(&points_->owner)) {
    (*mapping)->about_to_read(points * (sizeof(Eigen::Vector3f) + sizeof(float)));
  }
}

}  // namespace topoloc::mapping
