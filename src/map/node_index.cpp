// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/node_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <nanoflann.hpp>

namespace topoloc::map {
namespace {

#if NANOFLANN_VERSION >= 0x150
using SearchParameters = nanoflann::SearchParameters;
#else
using SearchParameters = nanoflann::SearchParams;
#endif

constexpr std::size_t kMaxNearest = 64;

struct Node {
  Eigen::Vector3d position_m;
  Eigen::Vector3d optical_axis;
};

/// nanoflann's view of the nodes.
struct NodeCloud {
  std::vector<Node> nodes;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return nodes.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return nodes[i].position_m[static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

/// Result set for nanoflann: the k nearest within a radius that look the right way, on the stack.
class NearestLookingAlike {
 public:
  using DistanceType = double;

  NearestLookingAlike(const NodeCloud& cloud, const Eigen::Vector3d& axis, double min_cosine,
                      std::size_t capacity, double max_squared_m2)
      : cloud_(cloud),
        axis_(axis),
        min_cosine_(min_cosine),
        capacity_(capacity),
        max_squared_m2_(max_squared_m2) {}

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] std::uint32_t id(std::size_t i) const { return found_[i].id; }

  /// The tree skips all that is not nearer than this: one step up lets equal distances through.
  [[nodiscard]] double worstDist() const {
    return std::nextafter(size_ == capacity_ ? found_[size_ - 1].squared_m2 : max_squared_m2_,
                          std::numeric_limits<double>::infinity());
  }

  bool addPoint(double squared_m2, std::size_t index) {
    const Found candidate{squared_m2, static_cast<std::uint32_t>(index)};
    if (squared_m2 > max_squared_m2_ || cloud_.nodes[index].optical_axis.dot(axis_) < min_cosine_ ||
        (size_ == capacity_ && !(candidate < found_[size_ - 1]))) {
      return true;
    }
    // Insertion sort: capacity is small.
    std::size_t i = size_ < capacity_ ? size_++ : size_ - 1;
    for (; i > 0 && candidate < found_[i - 1]; --i) {
      found_[i] = found_[i - 1];
    }
    found_[i] = candidate;
    return true;
  }

 private:
  struct Found {
    double squared_m2;
    std::uint32_t id;
    bool operator<(const Found& other) const {
      return squared_m2 < other.squared_m2 || (squared_m2 == other.squared_m2 && id < other.id);
    }
  };

  const NodeCloud& cloud_;
  Eigen::Vector3d axis_;
  double min_cosine_;
  std::size_t capacity_;
  double max_squared_m2_;
  std::array<Found, kMaxNearest> found_;  ///< the first size_ are set, in order
  std::size_t size_ = 0;
};

}  // namespace

class NodeIndex::Tree {
 public:
  explicit Tree(NodeCloud cloud)
      : cloud_(std::move(cloud)), tree_(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {}

  void search(const Eigen::Vector3d& position_m, NearestLookingAlike& result) const {
    tree_.findNeighbors(result, position_m.data(), SearchParameters());
  }
  [[nodiscard]] const NodeCloud& cloud() const { return cloud_; }

 private:
  NodeCloud cloud_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, NodeCloud>, NodeCloud, 3,
                                      std::uint32_t>
      tree_;
};

NodeIndex::NodeIndex(const MapFile& map) {
  NodeCloud cloud;
  cloud.nodes.resize(map.node_count());
  for (std::size_t i = 0; i < cloud.nodes.size(); ++i) {
    const RigidTransform T_world_cam = map.T_world_cam(i);
    cloud.nodes[i] = {T_world_cam.p, T_world_cam.R.col(2)};
  }
  tree_ = std::make_unique<Tree>(std::move(cloud));
}
NodeIndex::~NodeIndex() = default;
NodeIndex::NodeIndex(NodeIndex&&) noexcept = default;
NodeIndex& NodeIndex::operator=(NodeIndex&&) noexcept = default;

int NodeIndex::nearest(const RigidTransform& T_world_cam, int k, double max_distance_m,
                       double max_heading_rad, std::span<std::uint32_t> out) const noexcept {
  // Written so that NaN fails.
  if (!T_world_cam.p.allFinite() || !T_world_cam.R.allFinite() || k <= 0 || out.empty() ||
      !(max_distance_m >= 0.0) || !(max_heading_rad >= 0.0)) {
    return 0;
  }
  const double min_cosine = max_heading_rad >= std::numbers::pi ? -2.0 : std::cos(max_heading_rad);
  const std::size_t capacity = std::min({static_cast<std::size_t>(k), out.size(), kMaxNearest});
  NearestLookingAlike result(tree_->cloud(), T_world_cam.R.col(2), min_cosine, capacity,
                             max_distance_m * max_distance_m);
  tree_->search(T_world_cam.p, result);
  for (std::size_t i = 0; i < result.size(); ++i) {
    out[i] = result.id(i);
  }
  return static_cast<int>(result.size());
}

}  // namespace topoloc::map
