// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/map_matcher.hpp"

#include "topoloc/map/map_file.hpp"
#include "topoloc/map/node_index.hpp"
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/guided_matcher.hpp"
#include "topoloc/matching/outliers.hpp"
#include "topoloc/matching/undistorter.hpp"

#include "matching/band_extractor.hpp"
#include "matching/node_cache.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace topoloc::matching {
namespace {

/// Adds the time since construction or the last lap to a stage.
class Stopwatch {
 public:
  void lap(double& stage_ms) {
    const auto now = std::chrono::steady_clock::now();
    stage_ms += std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

const map::MapFile& with_same_model(const map::MapFile& map, const map::ModelIdentity& model) {
  if (map.info().model != model) {
    throw std::invalid_argument(map.path().string() + ": made with " +
                                map::to_string(map.info().model) + ", but the configuration has " +
                                map::to_string(model) +
                                ": build the map again or configure its model (matching.extractor, "
                                "width_px, height_px and max_features name the file)");
  }
  return map;
}

}  // namespace

std::string_view to_string(FrameVerdict verdict) {
  switch (verdict) {
    case FrameVerdict::kOk:
      return "ok";
    case FrameVerdict::kBadImage:
      return "bad_image";
    case FrameVerdict::kBadPrediction:
      return "bad_prediction";
    case FrameVerdict::kNoNodeNear:
      return "no_node_near";
    case FrameVerdict::kTooFewFeatures:
      return "too_few_features";
    case FrameVerdict::kTooFewMatches:
      return "too_few_matches";
  }
  return "unknown";
}

struct MapMatcher::Impl {
  /// A match that has a 3D point, on its way to a MapMatch.
  struct Lifted {
    estimation::MapMatch match;
    float score = 0.0F;
  };

  Impl(const MatchingConfig& config_in, const map::MapFile& map_in,
       const CameraCalibration& camera_in, const RigidTransform& T_imu_cam_in,
       const cv::Mat& raw_mask)
      : config(config_in),
        raw_size(camera_in.pinhole.width_px, camera_in.pinhole.height_px),
        T_imu_cam(T_imu_cam_in),
        undistorter(camera_in, matching_camera(config_in)),
        extractor(make_extractor(config_in)),
        band_extractor(make_band_extractor(config_in)),
        map(&with_same_model(map_in, extractor->identity())),
        index(map_in),
        cache(map_in),
        guided_matcher(config_in.guided, config_in.min_similarity, config_in.pixel_std_px) {
    MatchingConfig free = config;
    free.matcher = "mutual";
    nearest_matcher = make_matcher(free);
    if (config.matcher != "guided" && config.matcher != "mutual") {
      configured_matcher = make_matcher(config);
    }
    const cv::Mat mask = undistorter.mask(raw_mask, config.mask_erosion_px);
    extractor->set_mask(mask);
    if (band_extractor) {
      if (band_extractor->identity().descriptor_dim != extractor->identity().descriptor_dim) {
        throw std::invalid_argument(
            "the model for half of the rows has descriptors of another length");
      }
      band_extractor->set_mask(mask);
    }
  }

  FrameReport match(std::int64_t time_ns, const cv::Mat& raw_grey, const Prediction& prediction,
                    estimation::MapMatchSet& out, Effort effort);
  void prefetch(const RigidTransform& T_world_imu) const;
  void select_nodes(const RigidTransform& T_world_cam, FrameReport& report);
  FrameVerdict match_nodes(bool guided, const PredictedCamera& camera, FrameReport& report,
                           estimation::MapMatchSet& out);
  bool match_node(bool guided, const PredictedCamera& camera, const NodeFeatures& node);
  void lift(const PredictedCamera& camera, const NodeFeatures& node, int slot, FrameReport& report);
  [[nodiscard]] double pixel_std_px(const PredictedCamera& camera, const NodeFeatures& node,
                                    int feature, const Eigen::Vector3d& q_cam) const;
  void hand_out(FrameReport& report, estimation::MapMatchSet& out);

  MatchingConfig config;
  cv::Size raw_size;
  RigidTransform T_imu_cam;
  Undistorter undistorter;
  std::unique_ptr<FeatureExtractor> extractor;
  std::unique_ptr<FeatureExtractor> band_extractor;  ///< null where there is no model for it
  const map::MapFile* map;
  map::NodeIndex index;
  NodeCache cache;
  GuidedMatcher guided_matcher;
  // Need no prediction:
  std::unique_ptr<FeatureMatcher> nearest_matcher;
  std::unique_ptr<FeatureMatcher> configured_matcher;  ///< null: the nearest one

  // Of the current frame; members for their memory.
  cv::Mat image;
  FeatureSet query;
  FeatureMatcher* free_matcher = nullptr;  ///< one of the two
  std::vector<const NodeFeatures*> nodes;
  std::vector<ProjectedPoint> node_points;
  std::vector<FeatureMatch> feature_matches;
  std::vector<Lifted> lifted;
  std::vector<MatchGeometry> geometry;  ///< of each lifted match
  std::vector<std::uint8_t> keep;       ///< of each lifted match
  std::vector<std::size_t> kept;
};

FrameReport MapMatcher::Impl::match(std::int64_t time_ns, const cv::Mat& raw_grey,
                                    const Prediction& prediction, estimation::MapMatchSet& out,
                                    Effort effort) {
  FrameReport report;
  out.frame_time_ns = time_ns;
  out.node_count = 0;
  out.match_count = 0;
  const auto rejected = [&report](FrameVerdict verdict) {
    report.verdict = verdict;
    return report;
  };
  if (raw_grey.type() != CV_8UC1 || raw_grey.size() != raw_size) {
    return rejected(FrameVerdict::kBadImage);
  }
  if (!prediction.T_world_imu.R.allFinite() || !prediction.T_world_imu.p.allFinite() ||
      !prediction.covariance.allFinite()) {
    return rejected(FrameVerdict::kBadPrediction);
  }
  const PredictedCamera camera(undistorter.target(), T_imu_cam, prediction);

  Stopwatch stopwatch;
  select_nodes(camera.T_world_cam(), report);
  stopwatch.lap(report.times.select_ms);
  if (nodes.empty()) {
    return rejected(FrameVerdict::kNoNodeNear);
  }
  undistorter.undistort(raw_grey, image);
  stopwatch.lap(report.times.undistort_ms);
  const bool band = effort == Effort::kBand && band_extractor;
  (band ? band_extractor : extractor)->extract(image, query);
  stopwatch.lap(report.times.extract_ms);
  report.features = query.count;
  if (query.count < config.min_features) {
    return rejected(FrameVerdict::kTooFewFeatures);
  }

  free_matcher = configured_matcher && effort == Effort::kFull ? configured_matcher.get()
                                                               : nearest_matcher.get();
  const bool guided = config.matcher == "guided" || effort != Effort::kFull;
  report.verdict = match_nodes(guided, camera, report, out);
  if (guided && report.verdict != FrameVerdict::kOk) {
    // A filter that is surer than it is right looks in the wrong place: look everywhere.
    report.verdict = match_nodes(false, camera, report, out);
  }
  return report;
}

void MapMatcher::Impl::prefetch(const RigidTransform& T_world_imu) const {
  std::array<std::uint32_t, 2> ids{};
  const int found = index.nearest(T_world_imu * T_imu_cam, static_cast<int>(ids.size()),
                                  config.max_node_distance_m, config.max_node_heading_rad, ids);
  for (int i = 0; i < found; ++i) {
    map->prefetch(ids[static_cast<std::size_t>(i)]);
  }
}

void MapMatcher::Impl::select_nodes(const RigidTransform& T_world_cam, FrameReport& report) {
  // More than are used: where the nearest is damaged, its neighbour may be intact.
  std::array<std::uint32_t, NodeCache::kNodes> ids{};
  const int found = index.nearest(T_world_cam, static_cast<int>(ids.size()),
                                  config.max_node_distance_m, config.max_node_heading_rad, ids);
  const auto wanted = static_cast<std::size_t>(config.nodes_per_frame);
  nodes.clear();
  for (int i = 0; i < found && nodes.size() < wanted; ++i) {
    const NodeFeatures& node = cache.node(ids[static_cast<std::size_t>(i)]);
    if (!node.intact) {
      ++report.damaged_nodes;
      continue;
    }
    report.node_ids[nodes.size()] = node.node.node_id;
    nodes.push_back(&node);
  }
  report.node_count = static_cast<int>(nodes.size());
}

FrameVerdict MapMatcher::Impl::match_nodes(bool guided, const PredictedCamera& camera,
                                           FrameReport& report, estimation::MapMatchSet& out) {
  Stopwatch stopwatch;
  report.guided = guided;
  report.raw_matches = report.without_depth = report.behind_camera = 0;
  lifted.clear();
  geometry.clear();
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    if (!match_node(guided, camera, *nodes[slot])) {
      report.guided = false;
    }
    report.raw_matches += static_cast<int>(feature_matches.size());
    lift(camera, *nodes[slot], static_cast<int>(slot), report);
  }
  stopwatch.lap(report.times.match_ms);

  remove_outliers(geometry, camera.camera(), config.outliers, keep);
  hand_out(report, out);
  stopwatch.lap(report.times.outliers_ms);
  return report.matches < config.min_matches ? FrameVerdict::kTooFewMatches : FrameVerdict::kOk;
}

/// Fills feature_matches. Returns whether the prediction was used.
bool MapMatcher::Impl::match_node(bool guided, const PredictedCamera& camera,
                                  const NodeFeatures& node) {
  if (guided) {
    node_points.assign(static_cast<std::size_t>(node.features.count), {});
    for (int i = 0; i < node.features.count; ++i) {
      const auto slot = static_cast<std::size_t>(i);
      if (node.lifted(i)) {
        node_points[slot] = camera.project(node.points_world_m[slot]);
      }
    }
    if (guided_matcher.match(query, node.features, node_points, feature_matches)) {
      return true;
    }
  }
  free_matcher->match(query, node.features, feature_matches);
  return false;
}

void MapMatcher::Impl::lift(const PredictedCamera& camera, const NodeFeatures& node, int slot,
                            FrameReport& report) {
  for (const FeatureMatch& match : feature_matches) {
    if (!node.lifted(match.node)) {
      ++report.without_depth;
      continue;
    }
    const Eigen::Vector3d& p_world = node.points_world_m[static_cast<std::size_t>(match.node)];
    const ProjectedPoint predicted = camera.project(p_world);
    if (!predicted.visible) {
      ++report.behind_camera;
      continue;
    }
    const Eigen::Vector2d pixel =
        query.pixels_px[static_cast<std::size_t>(match.query)].cast<double>();
    const Eigen::Vector3d q_cam = camera.T_world_cam().inverse() * p_world;
    geometry.push_back({.pixel_px = pixel,
                        .predicted_px = predicted.pixel_px,
                        .predicted_std_px = std::sqrt(predicted.covariance.trace()),
                        .q_cam_m = q_cam});
    lifted.push_back({.match = {.pixel_px = pixel,
                                .p_world_m = p_world,
                                .pixel_std_px = pixel_std_px(camera, node, match.node, q_cam),
                                .node_slot = slot},
                      .score = match.score});
  }
}

/// Three independent errors move the projected point off the keypoint: that of the keypoint, that
/// of the node's keypoint (as large, scaled by the ratio of the depths), and that of the node's
/// depth, as far as it is not along the current ray.
double MapMatcher::Impl::pixel_std_px(const PredictedCamera& camera, const NodeFeatures& node,
                                      int feature, const Eigen::Vector3d& q_cam) const {
  const auto i = static_cast<std::size_t>(feature);
  const double depth_m = node.depths_m[i];
  const Eigen::Matrix3d R_cam_node = camera.T_world_cam().R.transpose() * node.node.R_world_cam;
  const Eigen::Vector3d ray = map->info().camera.ray(node.features.pixels_px[i].cast<double>());
  const double scale = camera.camera().fx_px / map->info().camera.fx_px * depth_m / q_cam.z();
  const Eigen::Vector2d per_depth = projection_jacobian(camera.camera(), q_cam) * R_cam_node * ray;
  const double depth_std_m = node.depth_stds_m[i];
  return std::sqrt(config.pixel_std_px * config.pixel_std_px * (1.0 + scale * scale) +
                   per_depth.squaredNorm() * depth_std_m * depth_std_m);
}

void MapMatcher::Impl::hand_out(FrameReport& report, estimation::MapMatchSet& out) {
  kept.clear();
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] != 0) {
      kept.push_back(i);
    }
  }
  report.outliers = static_cast<int>(lifted.size() - kept.size());
  report.over_capacity = std::max(0, static_cast<int>(kept.size()) - estimation::kMaxMatches);
  if (report.over_capacity > 0) {
    std::stable_sort(kept.begin(), kept.end(), [this](std::size_t a, std::size_t b) {
      return lifted[a].score > lifted[b].score;
    });
    kept.resize(estimation::kMaxMatches);
  }
  out.node_count = static_cast<int>(nodes.size());
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    out.nodes[slot] = nodes[slot]->node;
  }
  report.matches = static_cast<int>(kept.size());
  out.match_count = report.matches < config.min_matches ? 0 : report.matches;
  for (std::size_t i = 0; i < static_cast<std::size_t>(out.match_count); ++i) {
    out.matches[i] = lifted[kept[i]].match;
  }
}

MapMatcher::MapMatcher(const MatchingConfig& config, const map::MapFile& map,
                       const CameraCalibration& camera, const RigidTransform& T_imu_cam,
                       const cv::Mat& raw_mask)
    : impl_(std::make_unique<Impl>(config, map, camera, T_imu_cam, raw_mask)) {}
MapMatcher::~MapMatcher() = default;
MapMatcher::MapMatcher(MapMatcher&&) noexcept = default;
MapMatcher& MapMatcher::operator=(MapMatcher&&) noexcept = default;

FrameReport MapMatcher::match(std::int64_t time_ns, const cv::Mat& raw_grey,
                              const Prediction& prediction, estimation::MapMatchSet& out,
                              Effort effort) {
  return impl_->match(time_ns, raw_grey, prediction, out, effort);
}

Effort MapMatcher::least_effort() const {
  return impl_->band_extractor ? Effort::kBand : Effort::kGuided;
}

void MapMatcher::prefetch(const RigidTransform& T_world_imu) const { impl_->prefetch(T_world_imu); }

const PinholeCamera& MapMatcher::camera() const { return impl_->undistorter.target(); }

}  // namespace topoloc::matching
