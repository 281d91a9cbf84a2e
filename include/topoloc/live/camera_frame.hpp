// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace topoloc::live {

/// An image_t message as it came in, checked but not decoded (transport::view_image accepts it).
struct CameraFrame {
  std::int64_t time_ns = 0;      ///< mid-exposure, on the HostClock's line
  std::int64_t received_ns = 0;  ///< likewise
  std::vector<std::byte> message;
};

}  // namespace topoloc::live
