// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "inspect_drawings.hpp"

#include "drawing.hpp"
#include "figure_plot.hpp"
#include "node_images.hpp"
#include "overlay_image.hpp"
#include "plan_plot.hpp"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <stdexcept>

#include <fmt/chrono.h>
#include <fmt/core.h>

namespace topoloc::apps {
namespace {

constexpr std::size_t kUsualOverlays = 10;

std::vector<std::size_t> chosen_nodes(std::size_t count, int every) {
  std::vector<std::size_t> chosen;
  if (every > 0) {
    for (std::size_t i = 0; i < count; i += static_cast<std::size_t>(every)) {
      chosen.push_back(i);
    }
    return chosen;
  }
  const std::size_t wanted = std::min(count, kUsualOverlays);
  for (std::size_t i = 0; i < wanted; ++i) {
    chosen.push_back(wanted == 1 ? 0 : i * (count - 1) / (wanted - 1));
  }
  return chosen;
}

std::string utc(std::int64_t time_ns) {
  const auto seconds = static_cast<std::time_t>(time_ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03d} UTC", fmt::gmtime(seconds),
                     time_ns / 1'000'000 % 1000);
}

std::string title(const QualityNode& node, const MapQuality& quality) {
  std::string text = fmt::format("node {}", *node.id);
  if (quality.has_report) {
    text += fmt::format(", frame {}", node.report.frame);
  }
  text +=
      fmt::format("   {}   at {:.0f} m   std {:.1f} cm, {:.2f} deg   ", utc(node.report.time_ns),
                  node.along_m, 100.0 * *node.figure(kPositionStd), *node.figure(kRotationStd));
  return text + fmt::format("{:.0f} features, {:.0f} % with depth", *node.figure("features"),
                            100.0 * *node.figure(kLiftedShare));
}

void check_images(const map::MapFile& map, const MapQuality& quality) {
  const std::string where = map.path().string() + ": no overlay: ";
  if (!map.has_images()) {
    throw std::runtime_error(where +
                             "the map holds no camera images (topoloc-map strip removes them): "
                             "use the map as it was built");
  }
  if (!map.has_intensity_images()) {
    throw std::runtime_error(where + (quality.has_report
                                          ? "the cloud that the map is made from has no intensity"
                                          : "the map holds no LiDAR intensity, since an older "
                                            "topoloc-map made it: build it again"));
  }
}

}  // namespace

void write_overlays(const std::filesystem::path& folder, const map::MapFile& map,
                    const MapQuality& quality, int every) {
  check_images(map, quality);
  std::filesystem::create_directories(folder);
  std::vector<const QualityNode*> accepted;
  for (const QualityNode& node : quality.nodes) {
    if (node.id) {
      accepted.push_back(&node);
    }
  }
  std::size_t drawn = 0;
  for (const std::size_t i : chosen_nodes(accepted.size(), every)) {
    const NodeImages images = decode_images(map, i);
    if (images.grey.empty() || images.depth_m.empty() || images.intensity.empty()) {
      continue;
    }
    write_png(folder / fmt::format("node_{:06d}.png", i),
              draw_overlay(images, title(*accepted[i], quality)));
    ++drawn;
  }
  if (drawn == 0) {
    throw std::runtime_error(map.path().string() +
                             ": no overlay: none of the chosen nodes has all its images");
  }
}

void write_plots(const std::filesystem::path& folder, const map::MapFile& map,
                 const MapQuality& quality) {
  std::filesystem::create_directories(folder);
  write_png(folder / "map.png", draw_plan(map, quality));
  write_png(folder / "figures.png", draw_figures(map, quality));
}

}  // namespace topoloc::apps
