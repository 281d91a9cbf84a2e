// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "options.hpp"

#include <memory>

namespace topoloc::apps {

/// Plays the folder or the video file. Throws std::runtime_error that names the file.
std::unique_ptr<camera::ImageSource> make_recording(const CameraOptions& options,
                                                    const camera::Report& report);

}  // namespace topoloc::apps
