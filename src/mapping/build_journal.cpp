// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/build_journal.hpp"

#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/map_writer.hpp"

#include "mapping/pose_journal.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace topoloc::mapping {
namespace {

constexpr const char* kPosesFile = "poses.json";

std::string read_text(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Whole or not at all: written beside, then renamed.
void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  std::ofstream stream(temporary, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw std::runtime_error(temporary.string() + ": cannot be written");
  }
  std::filesystem::rename(temporary, path);
}

/// The figures of a node (and why it was rejected) are kept as a report of one node.
std::string report_text(std::size_t frame, const NodeOutcome& outcome) {
  MapReport report;
  NodeReport& node = report.nodes.emplace_back();
  node.frame = frame;
  if (outcome.rejected) {
    node.rejected = name(*outcome.rejected);
  }
  node.figures = outcome.figures;
  return to_json(report);
}

/// Nothing if the text is not what report_text() writes.
std::optional<NodeOutcome> parse_outcome(std::string_view text) {
  NodeOutcome outcome;
  try {
    const MapReport report = parse_map_report(text);
    const NodeReport& node = report.nodes.at(0);
    outcome.figures = node.figures;
    if (node.rejected) {
      outcome.rejected = reject_named(*node.rejected);
      if (!outcome.rejected) {
        return std::nullopt;
      }
    }
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return outcome;
}

std::string numbered(std::size_t frame, const char* extension) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "frame_%08zu.%s", frame, extension);
  return text.data();
}

map::NodeDraft to_draft(const map::NodeView& node) {
  map::NodeDraft draft;
  draft.time_ns = node.time_ns;
  draft.T_world_cam = node.T_world_cam;
  draft.covariance = node.covariance;
  for (const map::FeatureRecord& record : node.features) {
    draft.features.push_back(
        {record.pixel_px(), record.depth_m, record.depth_std_m(), record.score()});
  }
  draft.descriptors.assign(node.descriptors.begin(), node.descriptors.end());
  draft.camera_image.assign(node.camera_image.begin(), node.camera_image.end());
  draft.depth_image.assign(node.depth_image.begin(), node.depth_image.end());
  draft.intensity_image.assign(node.intensity_image.begin(), node.intensity_image.end());
  return draft;
}

}  // namespace

BuildJournal::BuildJournal(std::filesystem::path folder, const std::string& settings,
                           const map::MapInfo& info)
    : folder_(std::move(folder)), info_(info) {
  const std::filesystem::path settings_file = folder_ / "settings.txt";
  if (std::filesystem::exists(folder_) && read_text(settings_file) != settings) {
    // Only a folder of ours is ever deleted.
    if (!std::filesystem::exists(settings_file) && !std::filesystem::is_empty(folder_)) {
      throw std::runtime_error(folder_.string() +
                               ": is in the way: not the leftover of a map build");
    }
    std::filesystem::remove_all(folder_);
  }
  std::filesystem::create_directories(folder_);
  if (!std::filesystem::exists(settings_file)) {
    write_text(settings_file, settings);
  }
}

std::filesystem::path BuildJournal::node_file(std::size_t frame) const {
  return folder_ / numbered(frame, "tmap");
}

std::filesystem::path BuildJournal::reject_file(std::size_t frame) const {
  return folder_ / numbered(frame, "rejected");
}

bool BuildJournal::contains(std::size_t frame) const {
  if (parse_outcome(read_text(reject_file(frame)))) {
    return true;
  }
  return std::filesystem::exists(node_file(frame)) && map::verify(node_file(frame)).ok() &&
         parse_outcome(map::MapFile(node_file(frame)).report());
}

void BuildJournal::store(std::size_t frame, const NodeOutcome& outcome) const {
  if (outcome.rejected) {
    write_text(reject_file(frame), report_text(frame, outcome));
    return;
  }
  map::MapWriter writer(node_file(frame), info_);
  writer.add(outcome.draft);
  writer.set_report(report_text(frame, outcome));
  writer.finish();
}

NodeOutcome BuildJournal::load(std::size_t frame) const {
  if (auto rejected = parse_outcome(read_text(reject_file(frame)))) {
    return std::move(*rejected);
  }
  const map::MapFile file(node_file(frame), info_.model);
  auto outcome = parse_outcome(file.report());
  if (file.node_count() != 1 || !outcome) {
    throw std::runtime_error(node_file(frame).string() + ": is not the file of one node");
  }
  outcome->draft = to_draft(file.node(0));
  return std::move(*outcome);
}

void BuildJournal::store_poses(const std::vector<RefinedPose>& poses,
                               const std::string& settings) const {
  write_text(folder_ / kPosesFile, poses_text(poses, settings));
}

std::optional<std::vector<RefinedPose>> BuildJournal::load_poses(
    const std::filesystem::path& folder, const std::string& settings) {
  return parse_poses(read_text(folder / kPosesFile), settings);
}

void BuildJournal::remove() const { std::filesystem::remove_all(folder_); }

}  // namespace topoloc::mapping
