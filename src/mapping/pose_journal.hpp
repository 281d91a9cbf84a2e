// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/pose_refiner.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::mapping {

/// Refined poses as text, to the last bit, with the text of all that they depend on. Figures that
/// are not finite are left out: no map holds them.
std::string poses_text(const std::vector<RefinedPose>& poses, const std::string& settings);

/// What poses_text() was given; nothing if the text is none of its, or of other settings.
std::optional<std::vector<RefinedPose>> parse_poses(std::string_view text,
                                                    const std::string& settings);

}  // namespace topoloc::mapping
