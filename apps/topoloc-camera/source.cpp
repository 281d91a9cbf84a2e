// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "options.hpp"
#include "recordings.hpp"

#include <stdexcept>

namespace topoloc::apps {

std::unique_ptr<camera::ImageSource> make_source(const CameraOptions& options,
                                                 const camera::Report& report) {
  return make_recording(options, report);
}

bool list_cameras() { return false; }

}  // namespace topoloc::apps
