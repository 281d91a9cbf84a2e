// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/node_reject.hpp"

#include <algorithm>

namespace topoloc::mapping {

std::string_view name(NodeReject reason) {
  switch (reason) {
    case NodeReject::kUndecodableImage:
      return "undecodable_image";
    case NodeReject::kCloudNotInView:
      return "cloud_not_in_view";
    case NodeReject::kTooFewFeatures:
      return "too_few_features";
    case NodeReject::kTooFewLifted:
      return "too_few_lifted";
    case NodeReject::kPoseUnsupported:
      return "pose_unsupported";
    case NodeReject::kPoseUncertain:
      return "pose_uncertain";
    case NodeReject::kPoseContradicted:
      return "pose_contradicted";
  }
  return "unknown";
}

std::optional<NodeReject> reject_named(std::string_view name) {
  const auto* const reason =
      std::find_if(kNodeRejects.begin(), kNodeRejects.end(),
                   [&](NodeReject known) { return mapping::name(known) == name; });
  return reason == kNodeRejects.end() ? std::nullopt : std::optional(*reason);
}

}  // namespace topoloc::mapping
