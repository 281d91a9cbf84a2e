// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/map/types.hpp"
#include "topoloc/mapping/depth_check.hpp"
#include "topoloc/matching/features.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace topoloc::mapping {

/// Holds the depths of nodes' features against the images of the nodes before and after, one node
/// after the other in the order of the drive. Deterministic.
class NeighbourCheck {
 public:
  /// Features whose depth is not to be used.
  struct Verdict {
    std::size_t frame = 0;
    std::vector<std::size_t> features;
  };

  /// Matches as a vehicle with this configuration would, in `camera`. Throws as
  /// matching::make_matcher() does.
  NeighbourCheck(const matching::MatchingConfig& config, const PinholeCamera& camera);

  /// The next node; gives the verdict on the one before it, now that both its neighbours are known.
  std::optional<Verdict> next(std::size_t frame, map::NodeDraft node);
  /// There is no next one: the verdict on the last.
  std::optional<Verdict> finish();

 private:
  struct Node {
    std::size_t frame = 0;
    map::NodeDraft draft;
    matching::FeatureSet features;
    DepthWitnesses witnesses;
  };
  /// Nothing where they are too far apart to be compared.
  void compare(Node& a, Node& b);

  matching::MatchingConfig config_;
  PinholeCamera camera_;
  std::unique_ptr<matching::FeatureMatcher> matcher_;
  std::optional<Node> last_;
  std::vector<matching::FeatureMatch> matches_;
};

}  // namespace topoloc::mapping
