// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/map_writer.hpp"

#include "map/atomic_file.hpp"
#include "map/checks.hpp"
#include "map/checksum.hpp"
#include "map/file_assembler.hpp"
#include "map/format.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

namespace topoloc::map {
namespace {

constexpr std::size_t kCopyChunk = std::size_t{1} << 20;

template <typename T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span(&value, 1));
}

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// w x y z with w >= 0: one quaternion for each rotation.
std::array<double, 4> array_of(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q = Eigen::Quaterniond(R).normalized();
  if (q.w() < 0.0) {
    q.coeffs() = -q.coeffs();
  }
  return {q.w(), q.x(), q.y(), q.z()};
}

std::vector<std::byte> encode(const MapInfo& info) {
  format::InfoRecord record;
  record.width_px = info.camera.width_px;
  record.height_px = info.camera.height_px;
  record.camera_px = {info.camera.fx_px, info.camera.fy_px, info.camera.cx_px, info.camera.cy_px};
  record.p_imu_cam_m = array_of(info.T_imu_cam.p);
  record.q_imu_cam = array_of(info.T_imu_cam.R);
  record.origin_m = array_of(info.origin_m);
  record.model_fingerprint = info.model.fingerprint;
  record.descriptor_dim = static_cast<std::uint32_t>(info.model.descriptor_dim);
  record.model_name_length = static_cast<std::uint32_t>(info.model.name.size());
  record.crs_length = static_cast<std::uint32_t>(info.crs.size());
  record.creator_length = static_cast<std::uint32_t>(info.creator.size());

  std::vector<std::byte> bytes;
  const auto append = [&bytes](std::span<const std::byte> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  append(bytes_of(record));
  for (const std::string* s : {&info.model.name, &info.crs, &info.creator}) {
    append(std::as_bytes(std::span(*s)));
  }
  return bytes;
}

format::NodeRecord encode_pose(const NodeDraft& draft) {
  format::NodeRecord record;
  record.time_ns = draft.time_ns;
  record.p_world_cam_m = array_of(draft.T_world_cam.p);
  record.q_world_cam = array_of(draft.T_world_cam.R);
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = i; j < 6; ++j) {
      record.covariance[k++] = static_cast<float>(draft.covariance(i, j));
    }
  }
  return record;
}

NodeQuality quality_of(std::span<const FeatureRecord> features) {
  NodeQuality quality;
  quality.feature_count = static_cast<std::uint32_t>(features.size());
  double sum_m = 0.0;
  for (const FeatureRecord& feature : features) {
    if (feature.lifted()) {
      ++quality.lifted_count;
      sum_m += static_cast<double>(feature.depth_std_m());
    }
  }
  if (quality.lifted_count > 0) {
    quality.mean_depth_std_m = static_cast<float>(sum_m / quality.lifted_count);
  }
  return quality;
}

}  // namespace

class MapWriter::Impl {
 public:
  Impl(const std::filesystem::path& path, const MapInfo& info)
      : path_(path), info_(checked(path, info)), file_(path), images_(path), lidar_images_(path) {
    file_.begin_section(format::kFeatures, format::kSectionVersion, true);
  }

  void add(const NodeDraft& draft) {
    if (finished_) {
      throw MapError(path_.string() + ": a node was added after the map was finished");
    }
    check(draft);
    encode_block(draft);

    format::NodeRecord record = encode_pose(draft);
    const NodeQuality quality = quality_of(records_);
    record.feature_count = quality.feature_count;
    record.lifted_count = quality.lifted_count;
    record.mean_depth_std_m = quality.mean_depth_std_m;
    record.block_offset = next_block_offset_;
    record.block_checksum = checksum_of(block_);

    format::ImageEntry entry;
    entry.offset = images_.size();
    entry.camera_length = static_cast<std::uint32_t>(draft.camera_image.size());
    entry.depth_length = static_cast<std::uint32_t>(draft.depth_image.size());

    format::LidarEntry lidar_entry;
    lidar_entry.offset = lidar_images_.size();
    lidar_entry.length = static_cast<std::uint32_t>(draft.intensity_image.size());

    file_.append(block_);
    images_.append(draft.camera_image);
    images_.append(draft.depth_image);
    lidar_images_.append(draft.intensity_image);
    next_block_offset_ += block_.size();
    nodes_.push_back(record);
    image_entries_.push_back(entry);
    lidar_entries_.push_back(lidar_entry);
  }

  void set_report(std::string json) {
    const std::string problem = problem_with_report(json);
    if (!problem.empty()) {
      throw MapError(path_.string() + ": " + problem);
    }
    report_ = std::move(json);
  }

  void finish() {
    if (finished_) {
      throw MapError(path_.string() + ": the map was finished before");
    }
    if (nodes_.empty()) {
      throw MapError(path_.string() + ": not written: the map has no node");
    }
    finished_ = true;
    file_.end_section();
    add_section(format::kInfo, true, encode(info_));
    add_section(format::kNodes, true, std::as_bytes(std::span(nodes_)));
    if (images_.size() > 0) {
      add_section(format::kImageEntries, false, std::as_bytes(std::span(image_entries_)));
      add_images(format::kImages, images_);
    }
    if (lidar_images_.size() > 0) {
      add_section(format::kLidarEntries, false, std::as_bytes(std::span(lidar_entries_)));
      add_images(format::kLidarImages, lidar_images_);
    }
    if (!report_.empty()) {
      add_section(format::kReport, false, std::as_bytes(std::span(report_)));
    }
    file_.finish();
  }

 private:
  static const MapInfo& checked(const std::filesystem::path& path, const MapInfo& info) {
    const std::string problem = problem_with(info);
    if (!problem.empty()) {
      throw MapError(path.string() + ": " + problem);
    }
    return info;
  }

  void check(const NodeDraft& draft) const {
    const std::size_t count = draft.features.size();
    if (nodes_.size() >= kMaxNodes) {
      refuse("a map holds at most " + std::to_string(kMaxNodes) + " nodes");
    }
    if (!nodes_.empty() && draft.time_ns <= nodes_.back().time_ns) {
      refuse("time " + std::to_string(draft.time_ns) + " ns is not after the node before, " +
             std::to_string(nodes_.back().time_ns) + " ns");
    }
    if (!is_position(draft.T_world_cam.p)) {
      refuse("position is not finite or beyond 1e9 m");
    }
    if (!is_rotation(draft.T_world_cam.R)) {
      refuse("rotation of T_world_cam is not a finite rotation matrix");
    }
    if (!is_covariance(draft.covariance) ||
        draft.covariance.maxCoeff() > static_cast<double>(std::numeric_limits<float>::max())) {
      refuse("covariance is not finite, symmetric and positive semi-definite");
    }
    if (count > kMaxFeaturesPerNode) {
      refuse(std::to_string(count) + " features, at most " + std::to_string(kMaxFeaturesPerNode));
    }
    const std::size_t values = count * static_cast<std::size_t>(info_.model.descriptor_dim);
    if (draft.descriptors.size() != values) {
      refuse(std::to_string(draft.descriptors.size()) + " descriptor values, expected " +
             std::to_string(count) + " x " + std::to_string(info_.model.descriptor_dim));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::string problem = problem_with(draft.features[i], info_.camera);
      if (!problem.empty()) {
        refuse("feature " + std::to_string(i) + ": " + problem);
      }
    }
    check_image(draft.camera_image, problem_with_camera_image(draft.camera_image));
    check_image(draft.depth_image, problem_with_image(kDepthKind, draft.depth_image, info_.camera));
    check_image(draft.intensity_image,
                problem_with_image(kIntensityKind, draft.intensity_image, info_.camera));
  }

  void check_image(std::span<const std::byte> image, const std::string& problem) const {
    if (!problem.empty()) {
      refuse(problem);
    }
    if (image.size() > std::numeric_limits<std::uint32_t>::max()) {
      refuse("image of " + std::to_string(image.size()) + " bytes, at most 4 GiB");
    }
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw MapError(path_.string() + ": node " + std::to_string(nodes_.size()) + ": " + why);
  }

  /// Fills block_ (and records_) with the features and descriptors of a node.
  void encode_block(const NodeDraft& draft) {
    const std::uint64_t count = draft.features.size();
    records_.resize(count);
    std::transform(draft.features.begin(), draft.features.end(), records_.begin(),
                   &FeatureRecord::from);
    block_.assign(format::block_size(count, static_cast<std::uint64_t>(info_.model.descriptor_dim)),
                  std::byte{0});
    const auto records = std::as_bytes(std::span(records_));
    const auto descriptors = std::as_bytes(std::span(draft.descriptors));
    std::copy(records.begin(), records.end(), block_.begin());
    std::copy(descriptors.begin(), descriptors.end(),
              block_.begin() + static_cast<std::ptrdiff_t>(format::descriptors_offset(count)));
  }

  void add_section(std::string_view name, bool required, std::span<const std::byte> bytes) {
    file_.begin_section(name, format::kSectionVersion, required);
    file_.append(bytes);
    file_.end_section();
  }

  void add_images(std::string_view name, const SpoolFile& images) {
    file_.begin_section(name, format::kSectionVersion, false);
    std::vector<std::byte> buffer(std::min<std::uint64_t>(kCopyChunk, images.size()));
    for (std::uint64_t offset = 0; offset < images.size();) {
      const auto chunk =
          std::span(buffer).first(std::min<std::uint64_t>(buffer.size(), images.size() - offset));
      images.read(offset, chunk);
      file_.append(chunk);
      offset += chunk.size();
    }
    file_.end_section();
  }

  std::filesystem::path path_;
  MapInfo info_;
  FileAssembler file_;
  SpoolFile images_;  ///< images come last in the file, after all the features
  SpoolFile lidar_images_;
  std::vector<format::NodeRecord> nodes_;
  std::vector<format::ImageEntry> image_entries_;
  std::vector<format::LidarEntry> lidar_entries_;
  std::string report_;
  std::uint64_t next_block_offset_ = 0;
  std::vector<FeatureRecord> records_;  ///< of the node being added
  std::vector<std::byte> block_;        ///< of the node being added
  bool finished_ = false;
};

MapWriter::MapWriter(const std::filesystem::path& path, const MapInfo& info)
    : impl_(std::make_unique<Impl>(path, info)) {}
MapWriter::~MapWriter() = default;
void MapWriter::add(const NodeDraft& draft) { impl_->add(draft); }
void MapWriter::set_report(std::string json) { impl_->set_report(std::move(json)); }
void MapWriter::finish() { impl_->finish(); }

}  // namespace topoloc::map
