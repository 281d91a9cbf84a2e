// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/map_file.hpp"

#include "map/checks.hpp"
#include "map/checksum.hpp"
#include "map/format.hpp"
#include "map/section_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace topoloc::map {
namespace {

Eigen::Vector3d vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

RigidTransform transform_of(const std::array<double, 3>& p, const std::array<double, 4>& q) {
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix(), vector_of(p)};
}

bool is_unit(const std::array<double, 4>& q) {
  // Written so that NaN fails.
  return std::abs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0) <= 1e-9;
}

/// Elements of a section that is an array of records.
template <typename Record>
std::span<const Record> records(const std::string& file, const SectionInfo& section,
                                std::span<const std::byte> bytes) {
  if (bytes.size() % sizeof(Record) != 0) {
    throw MapError(file + ": section " + section.name + " of " + std::to_string(bytes.size()) +
                   " bytes is not a multiple of " + std::to_string(sizeof(Record)));
  }
  return {reinterpret_cast<const Record*>(bytes.data()), bytes.size() / sizeof(Record)};
}

MapInfo decode_info(const std::string& file, std::span<const std::byte> bytes) {
  format::InfoRecord record;
  if (bytes.size() < sizeof(record)) {
    throw MapError(file + ": section INFO of " + std::to_string(bytes.size()) +
                   " bytes, expected at least " + std::to_string(sizeof(record)));
  }
  std::memcpy(&record, bytes.data(), sizeof(record));
  std::span<const std::byte> rest = bytes.subspan(sizeof(record));
  if (std::uint64_t{record.model_name_length} + record.crs_length + record.creator_length !=
      rest.size()) {
    throw MapError(file + ": section INFO: its strings do not fill it");
  }
  const auto next_string = [&rest](std::uint32_t length) {
    const std::string s(reinterpret_cast<const char*>(rest.data()), length);
    rest = rest.subspan(length);
    return s;
  };
  MapInfo info;
  const auto& [fx, fy, cx, cy] = record.camera_px;
  info.camera = {record.width_px, record.height_px, fx, fy, cx, cy};
  info.T_imu_cam = transform_of(record.p_imu_cam_m, record.q_imu_cam);
  info.origin_m = vector_of(record.origin_m);
  info.model.fingerprint = record.model_fingerprint;
  info.model.descriptor_dim = static_cast<int>(
      std::min(record.descriptor_dim, static_cast<std::uint32_t>(kMaxDescriptorDim + 1)));
  info.model.name = next_string(record.model_name_length);
  info.crs = next_string(record.crs_length);
  info.creator = next_string(record.creator_length);
  const std::string problem = problem_with(info);
  if (!problem.empty()) {
    throw MapError(file + ": section INFO: " + problem);
  }
  return info;
}

/// What is wrong with a node on its own, or nothing.
const char* problem_with(const format::NodeRecord& node) {
  if (!is_position(vector_of(node.p_world_cam_m))) {
    return "position is not finite or beyond 1e9 m";
  }
  if (!is_unit(node.q_world_cam)) {
    return "rotation is not a unit quaternion";
  }
  if (!std::all_of(node.covariance.begin(), node.covariance.end(),
                   [](float x) { return std::isfinite(x); })) {
    return "covariance is not finite";
  }
  if (node.feature_count > kMaxFeaturesPerNode) {
    return "more than 16384 features";
  }
  if (node.lifted_count > node.feature_count) {
    return "more lifted features than features";
  }
  if (!(node.mean_depth_std_m >= 0.0F) || !std::isfinite(node.mean_depth_std_m)) {
    return "mean depth deviation is not finite or negative";
  }
  return nullptr;
}

/// Nodes must be good on their own, in order of time, and their feature blocks fill FEAT exactly.
void check_nodes(const std::string& file, std::span<const format::NodeRecord> nodes,
                 std::uint64_t features_length, int descriptor_dim) {
  const auto fail = [&file](std::size_t i, const std::string& why) {
    throw MapError(file + ": section NODE: node " + std::to_string(i) + ": " + why);
  };
  if (nodes.empty() || nodes.size() > kMaxNodes) {
    throw MapError(file + ": section NODE: " + std::to_string(nodes.size()) +
                   " nodes, expected 1 to " + std::to_string(kMaxNodes));
  }
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const char* const problem = problem_with(nodes[i]);
    if (problem != nullptr) {
      fail(i, problem);
    }
    if (i > 0 && nodes[i].time_ns <= nodes[i - 1].time_ns) {
      fail(i, "time is not after that of the node before");
    }
    if (nodes[i].block_offset != end) {
      fail(i, "features begin at byte " + std::to_string(nodes[i].block_offset) +
                  " of FEAT, expected " + std::to_string(end));
    }
    end += format::block_size(nodes[i].feature_count, static_cast<std::uint64_t>(descriptor_dim));
  }
  if (end != features_length) {
    throw MapError(file + ": section FEAT of " + std::to_string(features_length) +
                   " bytes, its nodes' features take " + std::to_string(end));
  }
}

std::uint64_t length_of(const format::ImageEntry& entry) {
  return std::uint64_t{entry.camera_length} + entry.depth_length;
}

std::uint64_t length_of(const format::LidarEntry& entry) { return entry.length; }

/// `entries` must name images that fill the section of images exactly, node by node.
template <typename Entry>
void check_image_entries(const std::string& file, std::string_view entries_name,
                         std::span<const Entry> entries, std::size_t node_count,
                         std::string_view images_name, std::uint64_t images_length) {
  const std::string where = file + ": section " + std::string(entries_name) + ": images of ";
  if (entries.size() != node_count) {
    throw MapError(where + std::to_string(entries.size()) + " nodes, expected " +
                   std::to_string(node_count));
  }
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].offset != end) {
      throw MapError(where + "node " + std::to_string(i) + " begin at byte " +
                     std::to_string(entries[i].offset) + " of " + std::string(images_name) +
                     ", expected " + std::to_string(end));
    }
    end += length_of(entries[i]);
  }
  if (end != images_length) {
    throw MapError(file + ": section " + std::string(images_name) + " of " +
                   std::to_string(images_length) + " bytes, its nodes' images take " +
                   std::to_string(end));
  }
}

}  // namespace

MapFile::MapFile(const std::filesystem::path& path,
                 const std::optional<ModelIdentity>& expected_model)
    : path_(path), file_(path) {
  open(expected_model);
}

void MapFile::open(const std::optional<ModelIdentity>& expected_model) {
  const std::string file = path_.string();
  sections_ = read_section_table(file, file_.bytes());
  const auto section = [&](std::string_view name) -> const SectionInfo& {
    const SectionInfo* const found = find_section(sections_, name);
    if (found == nullptr) {
      throw MapError(file + ": section " + std::string(name) + " is missing");
    }
    return *found;
  };

  const SectionInfo& info = section(format::kInfo);
  check_checksum(file, file_.bytes(), info);
  info_ = decode_info(file, content(file_.bytes(), info));
  if (expected_model && *expected_model != info_.model) {
    throw MapError(file + ": map made with another model: " + to_string(info_.model) +
                   ", expected " + to_string(*expected_model));
  }

  features_ = content(file_.bytes(), section(format::kFeatures));
  const SectionInfo& nodes = section(format::kNodes);
  check_checksum(file, file_.bytes(), nodes);
  nodes_ = records<format::NodeRecord>(file, nodes, content(file_.bytes(), nodes));
  check_nodes(file, nodes_, features_.size(), info_.model.descriptor_dim);

  /// Sections of images and of the entries that name them: both or none.
  const auto open_images =
      [&]<typename Entry>(std::string_view entries_name, std::string_view images_name,
                          std::span<const Entry>& entries, std::span<const std::byte>& images) {
        if (find_section(sections_, entries_name) == nullptr &&
            find_section(sections_, images_name) == nullptr) {
          return false;
        }
        images = content(file_.bytes(), section(images_name));
        const SectionInfo& directory = section(entries_name);
        check_checksum(file, file_.bytes(), directory);
        entries = records<Entry>(file, directory, content(file_.bytes(), directory));
        check_image_entries(file, entries_name, entries, nodes_.size(), images_name, images.size());
        return true;
      };
  has_images_ = open_images(format::kImageEntries, format::kImages, image_entries_, images_);
  has_intensity_images_ =
      open_images(format::kLidarEntries, format::kLidarImages, lidar_entries_, lidar_images_);
}

std::string_view MapFile::report() const {
  const SectionInfo* const section = find_section(sections_, format::kReport);
  if (section == nullptr) {
    return {};
  }
  check_checksum(path_.string(), file_.bytes(), *section);
  const std::span<const std::byte> text = content(file_.bytes(), *section);
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

std::span<const std::byte> MapFile::block(std::size_t i) const {
  return features_.subspan(
      nodes_[i].block_offset,
      format::block_size(nodes_[i].feature_count,
                         static_cast<std::uint64_t>(info_.model.descriptor_dim)));
}

NodeView MapFile::node(std::size_t i) const {
  const format::NodeRecord& record = nodes_[i];
  const std::size_t count = record.feature_count;
  const std::span<const std::byte> bytes = block(i);
  NodeView view;
  view.id = static_cast<std::uint32_t>(i);
  view.time_ns = record.time_ns;
  view.T_world_cam = T_world_cam(i);
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      const double value = static_cast<double>(record.covariance[k++]);
      view.covariance(row, column) = value;
      view.covariance(column, row) = value;
    }
  }
  view.quality = {record.feature_count, record.lifted_count, record.mean_depth_std_m};
  view.features = {reinterpret_cast<const FeatureRecord*>(bytes.data()), count};
  view.descriptors = {
      reinterpret_cast<const std::int8_t*>(bytes.data() + format::descriptors_offset(count)),
      count * static_cast<std::size_t>(info_.model.descriptor_dim)};
  if (has_images_) {
    const format::ImageEntry& entry = image_entries_[i];
    view.camera_image = images_.subspan(entry.offset, entry.camera_length);
    view.depth_image = images_.subspan(entry.offset + entry.camera_length, entry.depth_length);
  }
  if (has_intensity_images_) {
    view.intensity_image =
        lidar_images_.subspan(lidar_entries_[i].offset, lidar_entries_[i].length);
  }
  return view;
}

RigidTransform MapFile::T_world_cam(std::size_t i) const {
  return transform_of(nodes_[i].p_world_cam_m, nodes_[i].q_world_cam);
}

bool MapFile::node_intact(std::size_t i) const {
  return file_.unchanged() && checksum_of(block(i)) == nodes_[i].block_checksum;
}

void MapFile::prefetch(std::size_t i) const {
  if (!file_.unchanged()) {
    return;
  }
  const std::span<const std::byte> bytes = block(i);
  if (bytes.empty()) {
    return;
  }
  static const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(bytes.data()) / page * page;
  const auto end = reinterpret_cast<std::uintptr_t>(bytes.data() + bytes.size());
  // A hint: that it may fail does not matter.
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_WILLNEED);
}

}  // namespace topoloc::map
