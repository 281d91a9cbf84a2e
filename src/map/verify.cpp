// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"

#include "map/checks.hpp"
#include "map/checksum.hpp"
#include "map/format.hpp"
#include "map/section_table.hpp"

#include <algorithm>

namespace topoloc::map {
namespace {

constexpr std::uint64_t kChunk = std::uint64_t{16} << 20;

class Verifier {
 public:
  Verifier(const MapFile& map, VerifyReport& report,
           const std::function<void(std::uint64_t, std::uint64_t)>& progress)
      : map_(map), report_(report), progress_(progress) {}

  void run() {
    report_.node_count = map_.node_count();
    for (const SectionInfo& section : map_.sections()) {
      check_bytes(section);
    }
    for (std::size_t i = 0; i < map_.node_count(); ++i) {
      check_node(map_.node(i));
    }
    check_report();
  }

 private:
  void add(std::string_view section, std::uint64_t offset, std::string what) {
    if (report_.problems.size() < VerifyReport::kMaxProblems) {
      report_.problems.push_back({std::string(section), offset, std::move(what)});
    }
  }

  /// A checksum over the section as a whole: also what opening the map has checked before, since
  /// the file may lie on a disk that reads differently now, and it costs little.
  void check_bytes(const SectionInfo& section) {
    Checksum checksum;
    auto rest = map_.bytes().subspan(section.offset, section.extent);
    while (!rest.empty()) {
      const auto chunk = rest.first(std::min<std::uint64_t>(kChunk, rest.size()));
      checksum.update(chunk);
      rest = rest.subspan(chunk.size());
      done_ += chunk.size();
      if (progress_) {
        progress_(done_, map_.file_size() - format::kHeadSize);
      }
    }
    if (checksum.value() != section.checksum) {
      add(section.name, section.offset,
          "wrong checksum in the " + std::to_string(section.extent) + " bytes of the section");
    }
  }

  void check_node(const NodeView& node) {
    const std::string name = "node " + std::to_string(node.id) + ": ";
    const std::uint64_t features_offset = offset_of(std::as_bytes(node.features));
    if (!is_covariance(node.covariance)) {
      add(format::kNodes,
          find_section(map_.sections(), format::kNodes)->offset +
              node.id * sizeof(format::NodeRecord),
          name + "covariance is not positive semi-definite");
    }
    if (!map_.node_intact(node.id)) {
      add(format::kFeatures, features_offset, name + "wrong checksum of its features");
    }
    std::uint32_t lifted = 0;
    for (std::size_t k = 0; k < node.features.size(); ++k) {
      lifted += node.features[k].lifted() ? 1U : 0U;
      const std::string problem = problem_with(node.features[k], map_.info().camera);
      if (!problem.empty()) {
        add(format::kFeatures, features_offset + k * sizeof(FeatureRecord),
            name + "feature " + std::to_string(k) + ": " + problem);
      }
    }
    if (lifted != node.quality.lifted_count) {
      add(format::kFeatures, features_offset,
          name + std::to_string(lifted) + " lifted features, its record says " +
              std::to_string(node.quality.lifted_count));
    }
    check_images(node, name);
  }

  void check_images(const NodeView& node, const std::string& name) {
    const std::string camera_problem = problem_with_camera_image(node.camera_image);
    if (!camera_problem.empty()) {
      add(format::kImages, offset_of(node.camera_image), name + camera_problem);
    }
    check_image(kDepthKind, node.depth_image, decode_depth, format::kImages, name);
    check_image(kIntensityKind, node.intensity_image, decode_intensity, format::kLidarImages, name);
  }

  template <typename Decode>
  void check_image(const ZstdImageKind& kind, std::span<const std::byte> image,
                   const Decode& decode, std::string_view section, const std::string& node_name) {
    std::string problem = problem_with_image(kind, image, map_.info().camera);
    if (problem.empty() && !image.empty()) {
      try {
        int width_px = 0;
        int height_px = 0;
        decode(image, width_px, height_px);
      } catch (const MapError& error) {
        problem = error.what();
      }
    }
    if (!problem.empty()) {
      add(section, offset_of(image), node_name + problem);
    }
  }

  /// Not through MapFile::report(), which throws where check_bytes() has told already.
  void check_report() {
    const SectionInfo* const section = find_section(map_.sections(), format::kReport);
    if (section == nullptr) {
      return;
    }
    const auto text = content(map_.bytes(), *section);
    const std::string problem =
        problem_with_report({reinterpret_cast<const char*>(text.data()), text.size()});
    if (!problem.empty()) {
      add(format::kReport, section->offset, problem);
    }
  }

  [[nodiscard]] std::uint64_t offset_of(std::span<const std::byte> part) const {
    return static_cast<std::uint64_t>(part.data() - map_.bytes().data());
  }

  const MapFile& map_;
  VerifyReport& report_;
  const std::function<void(std::uint64_t, std::uint64_t)>& progress_;
  std::uint64_t done_ = 0;
};

}  // namespace

VerifyReport verify(const std::filesystem::path& path,
                    const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  VerifyReport report;
  try {
    const MapFile map(path);
    Verifier(map, report, progress).run();
  } catch (const MapError& error) {
    report.problems.push_back({"file", 0, error.what()});
  }
  return report;
}

}  // namespace topoloc::map
