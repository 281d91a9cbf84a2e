// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/neighbour_check.hpp"

#include "topoloc/geometry/so3.hpp"

#include <utility>

namespace topoloc::mapping {
namespace {

/// Guided matching is for a vehicle that knows about where it is: two nodes are matched freely.
matching::MatchingConfig free_matching(matching::MatchingConfig config) {
  if (config.matcher == "guided") {
    config.matcher = "mutual";
  }
  return config;
}

matching::FeatureSet unpacked(const map::NodeDraft& draft, const PinholeCamera& camera) {
  const std::size_t count = draft.features.size();
  const std::size_t dim = count == 0 ? 0 : draft.descriptors.size() / count;
  matching::FeatureSet features(static_cast<int>(count), static_cast<int>(dim));
  features.count = static_cast<int>(count);
  features.width_px = camera.width_px;
  features.height_px = camera.height_px;
  for (std::size_t i = 0; i < count; ++i) {
    features.pixels_px[i] = draft.features[i].pixel_px;
    features.scores[i] = draft.features[i].score;
  }
  map::decode_descriptors(draft.descriptors, features.descriptors);
  return features;
}

void testify(const map::Feature& from, const map::Feature& to, const RigidTransform& T_to_from,
             const PinholeCamera& camera, std::size_t feature, DepthWitnesses& witnesses) {
  if (from.depth_m <= 0.0F) {
    return;
  }
  const DepthWitness said = witness({.from_px = from.pixel_px.cast<double>(),
                                     .depth_m = static_cast<double>(from.depth_m),
                                     .depth_std_m = static_cast<double>(from.depth_std_m),
                                     .to_px = to.pixel_px.cast<double>()},
                                    T_to_from, camera);
  if (said == DepthWitness::kConfirms) {
    ++witnesses.confirm[feature];
  } else if (said == DepthWitness::kContradicts) {
    ++witnesses.contradict[feature];
  }
}

}  // namespace

NeighbourCheck::NeighbourCheck(const matching::MatchingConfig& config, const PinholeCamera& camera)
    : config_(free_matching(config)), camera_(camera), matcher_(matching::make_matcher(config_)) {}

std::optional<NeighbourCheck::Verdict> NeighbourCheck::next(std::size_t frame,
                                                            map::NodeDraft node) {
  const std::size_t count = node.features.size();
  Node current{.frame = frame,
               .draft = std::move(node),
               .features = {},
               .witnesses = {std::vector<std::uint8_t>(count), std::vector<std::uint8_t>(count)}};
  current.features = unpacked(current.draft, camera_);
  if (last_) {
    compare(*last_, current);
  }
  std::optional<Verdict> verdict = finish();
  last_ = std::move(current);
  return verdict;
}

std::optional<NeighbourCheck::Verdict> NeighbourCheck::finish() {
  if (!last_) {
    return std::nullopt;
  }
  Verdict verdict{last_->frame, contradicted_depths(last_->draft.features, last_->witnesses)};
  last_.reset();
  return verdict;
}

void NeighbourCheck::compare(Node& a, Node& b) {
  const RigidTransform T_ab = a.draft.T_world_cam.inverse() * b.draft.T_world_cam;
  if (T_ab.p.norm() >= config_.max_node_distance_m ||
      so3::log(T_ab.R).norm() >= config_.max_node_heading_rad) {
    return;
  }
  const RigidTransform T_ba = T_ab.inverse();
  matcher_->match(a.features, b.features, matches_);
  for (const matching::FeatureMatch& match : matches_) {
    const auto in_a = static_cast<std::size_t>(match.query);
    const auto in_b = static_cast<std::size_t>(match.node);
    const map::Feature& feature_a = a.draft.features[in_a];
    const map::Feature& feature_b = b.draft.features[in_b];
    testify(feature_a, feature_b, T_ba, camera_, in_a, a.witnesses);
    testify(feature_b, feature_a, T_ab, camera_, in_b, b.witnesses);
  }
}

}  // namespace topoloc::mapping
