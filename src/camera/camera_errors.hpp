// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <string>

namespace topoloc::camera {

/// "DEVICE: what (system's message): what to do". `error`: errno, 0 for none.
std::string camera_error_text(const std::string& device, const std::string& what, int error);

}  // namespace topoloc::camera
