// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/feature_record.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

/// The bytes of a .tmap file; docs/map-format.md is the same in prose. Structures are read in place
/// from the mapped file, so the file's byte order must be the machine's.
namespace topoloc::map::format {

static_assert(std::endian::native == std::endian::little, "map files are little-endian");

/// As PNG's: the first byte catches 7-bit transfers, the line end catches text-mode ones.
inline constexpr std::array<char, 8> kMagic{'\x89', 'T', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint32_t kFormatVersion = 1;

/// Header and section table fill the first page; sections follow one another from there.
inline constexpr std::uint64_t kHeadSize = 4096;
inline constexpr std::uint64_t kAlignment = 64;

constexpr std::uint64_t aligned(std::uint64_t size) {
  return (size + kAlignment - 1) / kAlignment * kAlignment;
}

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t format_version = kFormatVersion;
  std::uint32_t section_count = 0;
  std::uint64_t file_size = 0;
  std::array<std::uint8_t, 32> reserved{};
  std::uint64_t checksum = 0;  ///< XXH3-64 of the head, these eight bytes left out
};
static_assert(sizeof(Header) == 64);

struct SectionEntry {
  std::array<char, 4> name{};
  std::uint32_t version = 0;
  std::uint32_t flags = 0;  ///< kRequired or 0
  std::uint32_t reserved = 0;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;    ///< without the padding to kAlignment
  std::uint64_t checksum = 0;  ///< XXH3-64 of the section with its padding
};
static_assert(sizeof(SectionEntry) == 40);
inline constexpr std::uint32_t kRequired = 1;
inline constexpr std::uint64_t kMaxSections = (kHeadSize - sizeof(Header)) / sizeof(SectionEntry);

inline constexpr std::string_view kFeatures = "FEAT";      ///< feature blocks
inline constexpr std::string_view kInfo = "INFO";          ///< InfoRecord and strings
inline constexpr std::string_view kNodes = "NODE";         ///< NodeRecord each
inline constexpr std::string_view kImageEntries = "IDIR";  ///< ImageEntry each; optional
inline constexpr std::string_view kImages = "IMAG";        ///< encoded images; optional
inline constexpr std::string_view kLidarEntries = "LDIR";  ///< LidarEntry each; optional
inline constexpr std::string_view kLidarImages = "LIMG";   ///< encoded images; optional
inline constexpr std::string_view kReport = "REPT";        ///< JSON; optional
inline constexpr std::uint32_t kSectionVersion = 1;        ///< of all of them, so far

/// Followed by the characters of model name, CRS and creator, without separators.
struct InfoRecord {
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::array<double, 4> camera_px{};  ///< fx fy cx cy
  std::array<double, 3> p_imu_cam_m{};
  std::array<double, 4> q_imu_cam{};  ///< w x y z
  std::array<double, 3> origin_m{};
  std::uint64_t model_fingerprint = 0;
  std::uint32_t descriptor_dim = 0;
  std::uint32_t model_name_length = 0;
  std::uint32_t crs_length = 0;
  std::uint32_t creator_length = 0;
};
static_assert(sizeof(InfoRecord) == 144);

struct NodeRecord {
  std::int64_t time_ns = 0;
  std::array<double, 3> p_world_cam_m{};
  std::array<double, 4> q_world_cam{};  ///< w x y z
  std::array<float, 21> covariance{};   ///< upper triangle, row by row
  std::uint32_t feature_count = 0;
  std::uint64_t block_offset = 0;    ///< of the node's feature block, from the start of FEAT
  std::uint64_t block_checksum = 0;  ///< XXH3-64 of the block
  std::uint32_t lifted_count = 0;
  float mean_depth_std_m = 0.0F;
  std::array<std::uint8_t, 16> reserved{};
};
static_assert(sizeof(NodeRecord) == 192);

/// Where the images of a node lie: camera image at offset, depth image right behind.
struct ImageEntry {
  std::uint64_t offset = 0;  ///< from the start of IMAG
  std::uint32_t camera_length = 0;
  std::uint32_t depth_length = 0;
};
static_assert(sizeof(ImageEntry) == 16);

/// Where the intensity image of a node lies. Apart from IMAG, whose layout old readers check.
struct LidarEntry {
  std::uint64_t offset = 0;  ///< from the start of LIMG
  std::uint32_t length = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(LidarEntry) == 16);

static_assert(std::is_trivially_copyable_v<Header> && std::is_trivially_copyable_v<SectionEntry> &&
              std::is_trivially_copyable_v<InfoRecord> &&
              std::is_trivially_copyable_v<NodeRecord> &&
              std::is_trivially_copyable_v<ImageEntry> && std::is_trivially_copyable_v<LidarEntry>);

/// A feature block: records, padding, descriptors, padding. Both parts aligned.
constexpr std::uint64_t descriptors_offset(std::uint64_t feature_count) {
  return aligned(feature_count * sizeof(FeatureRecord));
}
constexpr std::uint64_t block_size(std::uint64_t feature_count, std::uint64_t descriptor_dim) {
  return descriptors_offset(feature_count) + aligned(feature_count * descriptor_dim);
}

}  // namespace topoloc::map::format
