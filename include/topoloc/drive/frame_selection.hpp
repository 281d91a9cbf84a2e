// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <string>

namespace topoloc::drive {

/// Which frames of a log are used, by their place in it: so that one drive can serve as map and as
/// query without a frame being matched with itself.
enum class FrameSelection { kAll, kEven, kOdd };

/// "all", "even" or "odd"; std::invalid_argument otherwise.
FrameSelection parse_frame_selection(const std::string& text);
bool selected(FrameSelection selection, std::size_t index);

}  // namespace topoloc::drive
