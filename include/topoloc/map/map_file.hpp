// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/mapped_file.hpp"
#include "topoloc/map/types.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::map {

namespace format {
struct NodeRecord;
struct ImageEntry;
struct LidarEntry;
}  // namespace format

/// A node of an open map. The spans point into the mapped file and live as long as the MapFile.
struct NodeView {
  std::uint32_t id = 0;  ///< index of the node in the map
  std::int64_t time_ns = 0;
  RigidTransform T_world_cam;
  Eigen::Matrix<double, 6, 6> covariance;  ///< as in NodeDraft
  NodeQuality quality;
  std::span<const FeatureRecord> features;
  std::span<const std::int8_t> descriptors;  ///< features x descriptor_dim, row-major
  std::span<const std::byte> camera_image;   ///< empty in a stripped map
  std::span<const std::byte> depth_image;    ///< empty in a stripped map
  /// Empty in a stripped map, and where the builder had no intensities.
  std::span<const std::byte> intensity_image;
};

/// Where a section lies in the file.
struct SectionInfo {
  std::string name;  ///< four characters, as in docs/map-format.md
  std::uint32_t version = 0;
  bool required = false;
  bool known = false;  ///< to this reader; unknown optional sections are ignored
  std::uint64_t offset = 0;
  std::uint64_t length = 0;  ///< without padding
  std::uint64_t extent = 0;  ///< with padding: what the checksum covers
  std::uint64_t checksum = 0;
};

/// A map, memory-mapped read-only. Movable; const members may be called from many threads.
///
/// Opening checks the header, the section table, all sizes and ranges, and the checksums of all but
/// the feature and image sections, whose pages stay untouched: a map of any size opens at once.
/// Features and images are checked by verify(), or node by node by node_intact().
class MapFile {
 public:
  /// Throws MapError (naming file, section and what was found) on anything but an intact map, and,
  /// if `expected_model` is given, on a map whose descriptors another model made.
  explicit MapFile(const std::filesystem::path& path,
                   const std::optional<ModelIdentity>& expected_model = std::nullopt);

  [[nodiscard]] const MapInfo& info() const { return info_; }
  [[nodiscard]] std::size_t node_count() const { return nodes_.size(); }
  /// False after `topoloc-map strip`.
  [[nodiscard]] bool has_images() const { return has_images_; }
  /// False after `topoloc-map strip`, in maps of older programs, and for clouds without intensity.
  [[nodiscard]] bool has_intensity_images() const { return has_intensity_images_; }

  /// The build report as JSON (mapping::MapReport); empty in maps of older programs. Reads and
  /// checks it: throws MapError if it is damaged.
  [[nodiscard]] std::string_view report() const;

  /// Node i < node_count(). Touches no feature or image page, does not allocate.
  [[nodiscard]] NodeView node(std::size_t i) const;
  /// Pose of node i alone: cheaper where nothing else is needed.
  [[nodiscard]] RigidTransform T_world_cam(std::size_t i) const;

  /// Whether the features and descriptors of node i match their checksum (reads them: about 5 us
  /// in memory), and the file is still as it was opened. Call before the first use of a node where
  /// damage must not reach the estimator.
  [[nodiscard]] bool node_intact(std::size_t i) const;

  /// Asks the kernel to read the features of node i ahead; returns at once.
  void prefetch(std::size_t i) const;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t file_size() const { return bytes().size(); }
  [[nodiscard]] const std::vector<SectionInfo>& sections() const { return sections_; }
  /// The whole file, for verify() and strip().
  [[nodiscard]] std::span<const std::byte> bytes() const { return file_.bytes(); }

 private:
  void open(const std::optional<ModelIdentity>& expected_model);
  [[nodiscard]] std::span<const std::byte> block(std::size_t i) const;

  std::filesystem::path path_;
  MappedFile file_;
  std::vector<SectionInfo> sections_;
  MapInfo info_;
  std::span<const format::NodeRecord> nodes_;
  std::span<const std::byte> features_;
  bool has_images_ = false;
  std::span<const format::ImageEntry> image_entries_;
  std::span<const std::byte> images_;
  bool has_intensity_images_ = false;
  std::span<const format::LidarEntry> lidar_entries_;
  std::span<const std::byte> lidar_images_;
};

}  // namespace topoloc::map
