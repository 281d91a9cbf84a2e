// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace topoloc::mapping {

/// Why a planned node is not in the map.
enum class NodeReject {
  kUndecodableImage,
  kCloudNotInView,  ///< coverage below min_coverage
  kTooFewFeatures,
  kTooFewLifted,
  kPoseUnsupported,   ///< no registration on the cloud near enough along the way
  kPoseUncertain,     ///< its covariance is too large
  kPoseContradicted,  ///< what was found on the cloud there says otherwise
};

inline constexpr std::array kNodeRejects{NodeReject::kUndecodableImage, NodeReject::kCloudNotInView,
                                         NodeReject::kTooFewFeatures,   NodeReject::kTooFewLifted,
                                         NodeReject::kPoseUnsupported,  NodeReject::kPoseUncertain,
                                         NodeReject::kPoseContradicted};

/// "too_few_features"
std::string_view name(NodeReject reason);
/// The reason of that name, if there is one.
std::optional<NodeReject> reject_named(std::string_view name);

}  // namespace topoloc::mapping
