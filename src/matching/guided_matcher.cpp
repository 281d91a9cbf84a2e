// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/guided_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

namespace topoloc::matching {
namespace {

constexpr double kCell_px = 32.0;

/// Cell of a coordinate, the border cells being open outwards. (Clamped before the cast: a far
/// projection does not fit an int.)
int cell(double px, int cells) {
  return static_cast<int>(std::clamp(px / kCell_px, 0.0, static_cast<double>(cells - 1)));
}

/// Distance of two unit descriptors with cosine c.
double distance(float c) { return std::sqrt(std::max(0.0, 2.0 - 2.0 * static_cast<double>(c))); }

/// Largest standard deviation over all directions.
double largest_std(const Eigen::Matrix2d& S) {
  const double mean = 0.5 * S.trace();
  const double half_difference = 0.5 * (S(0, 0) - S(1, 1));
  return std::sqrt(mean + std::hypot(half_difference, S(0, 1)));
}

}  // namespace

GuidedMatcher::GuidedMatcher(const GuidedConfig& config, double min_similarity, double pixel_std_px)
    : config_(config),
      min_similarity_(static_cast<float>(min_similarity)),
      noise_variance_px2_(2.0 * pixel_std_px * pixel_std_px) {}

void GuidedMatcher::build_grid(const FeatureSet& query) {
  columns_ = static_cast<int>(query.width_px / kCell_px) + 1;
  rows_ = static_cast<int>(query.height_px / kCell_px) + 1;
  const auto count = static_cast<std::size_t>(query.count);
  cell_start_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  cell_of_.resize(count);
  cell_features_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2f& pixel = query.pixels_px[i];
    // A pixel that is not a number lies in no gate: any cell will do.
    const bool finite = pixel.allFinite();
    cell_of_[i] = finite ? cell(pixel.y(), rows_) * columns_ + cell(pixel.x(), columns_) : 0;
    ++cell_start_[static_cast<std::size_t>(cell_of_[i]) + 1];
  }
  for (std::size_t c = 1; c < cell_start_.size(); ++c) {
    cell_start_[c] += cell_start_[c - 1];
  }
  fill_position_.assign(cell_start_.begin(), cell_start_.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    int& position = fill_position_[static_cast<std::size_t>(cell_of_[i])];
    cell_features_[static_cast<std::size_t>(position++)] = static_cast<int>(i);
  }
}

bool GuidedMatcher::match(const FeatureSet& query, const FeatureSet& node,
                          std::span<const ProjectedPoint> node_points,
                          std::vector<FeatureMatch>& out) {
  out.clear();
  if (node_points.size() != static_cast<std::size_t>(node.count) ||
      (query.count > 0 && node.count > 0 && query.descriptor_dim != node.descriptor_dim)) {
    throw std::invalid_argument("guided matching: node points or descriptors do not fit the node");
  }
  gates_px_.clear();
  for (const ProjectedPoint& point : node_points) {
    if (point.visible) {
      gates_px_.push_back(config_.gate_sigmas * largest_std(innovation(point)));
    }
  }
  if (gates_px_.empty() || query.count == 0) {
    return true;  // guided, and nothing to find
  }
  const auto middle = gates_px_.begin() + static_cast<std::ptrdiff_t>(gates_px_.size() / 2);
  std::nth_element(gates_px_.begin(), middle, gates_px_.end());
  if (!(*middle <= config_.max_gate_px)) {
    return false;
  }

  build_grid(query);
  best_of_node_.assign(static_cast<std::size_t>(node.count), {});
  best_of_query_.assign(static_cast<std::size_t>(query.count), {});
  for (int n = 0; n < node.count; ++n) {
    if (near_image(query, node_points[static_cast<std::size_t>(n)])) {
      search(query, node, n, node_points[static_cast<std::size_t>(n)]);
    }
  }
  for (int n = 0; n < node.count; ++n) {
    const Best& best = best_of_node_[static_cast<std::size_t>(n)];
    if (best.index >= 0 && best.first >= min_similarity_ &&
        best_of_query_[static_cast<std::size_t>(best.index)].index == n &&
        (best.second == kNone || distance(best.first) <= config_.ratio * distance(best.second))) {
      out.push_back({.query = best.index, .node = n, .score = best.first});
    }
  }
  return true;
}

Eigen::Matrix2d GuidedMatcher::innovation(const ProjectedPoint& point) const {
  return point.covariance + noise_variance_px2_ * Eigen::Matrix2d::Identity();
}

bool GuidedMatcher::near_image(const FeatureSet& query, const ProjectedPoint& point) const {
  // Far off the axis the linearised gate grows without bound, and would take in the whole image.
  const double border_px = config_.max_gate_px;
  const Eigen::Array2d limit(query.width_px + border_px, query.height_px + border_px);
  return point.visible && (point.pixel_px.array() >= -border_px).all() &&
         (point.pixel_px.array() <= limit).all();
}

void GuidedMatcher::search(const FeatureSet& query, const FeatureSet& node, int n,
                           const ProjectedPoint& point) {
  const Eigen::Matrix2d S = innovation(point);
  const Eigen::Matrix2d information = S.inverse();
  const double gate2 = config_.gate_sigmas * config_.gate_sigmas;
  const double min_gate2_px2 = config_.min_gate_px * config_.min_gate_px;
  const double half_width = std::max(config_.min_gate_px, config_.gate_sigmas * std::sqrt(S(0, 0)));
  const double half_height =
      std::max(config_.min_gate_px, config_.gate_sigmas * std::sqrt(S(1, 1)));
  const int first_column = cell(point.pixel_px.x() - half_width, columns_);
  const int last_column = cell(point.pixel_px.x() + half_width, columns_);
  const int first_row = cell(point.pixel_px.y() - half_height, rows_);
  const int last_row = cell(point.pixel_px.y() + half_height, rows_);

  const auto query_descriptors = query.descriptor_matrix();
  const auto descriptor = node.descriptor_matrix().row(n);
  Best& best = best_of_node_[static_cast<std::size_t>(n)];
  for (int row = first_row; row <= last_row; ++row) {
    // Cells of one row lie side by side in cell_features_.
    const auto first = static_cast<std::size_t>(row * columns_ + first_column);
    const auto last = static_cast<std::size_t>(row * columns_ + last_column);
    const int begin = cell_start_[first];
    const int end = cell_start_[last + 1];
    for (int k = begin; k < end; ++k) {
      const int q = cell_features_[static_cast<std::size_t>(k)];
      const Eigen::Vector2d e =
          query.pixels_px[static_cast<std::size_t>(q)].cast<double>() - point.pixel_px;
      if (!(e.squaredNorm() <= min_gate2_px2 || e.dot(information * e) <= gate2)) {
        continue;
      }
      const float similarity = query_descriptors.row(q).dot(descriptor);
      if (similarity > best.first) {
        best.second = best.first;
        best.first = similarity;
        best.index = q;
      } else {
        best.second = std::max(best.second, similarity);
      }
      Best& best_node = best_of_query_[static_cast<std::size_t>(q)];
      if (similarity > best_node.first) {
        best_node.first = similarity;
        best_node.index = n;
      }
    }
  }
}

}  // namespace topoloc::matching
