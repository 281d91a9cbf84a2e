// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace topoloc::camera {

/// Mid-exposure of one image.
struct ImageStamp {
  std::int64_t time_ns = 0;
  std::string name;  ///< of the image, where the file says so
};

/// A file of time stamps, one a line and increasing; after the time, or after it and a comma, there
/// may be the name of the image (as in TUM's and EuRoC's lists), on all lines or on none. A time
/// with a decimal point is in seconds, a whole number in nanoseconds. Lines that begin with # and
/// empty ones do not count.
///
/// Throws std::runtime_error ("FILE:LINE: what was found, what is expected").
std::vector<ImageStamp> read_stamps(const std::filesystem::path& file);

}  // namespace topoloc::camera
