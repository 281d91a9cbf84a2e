// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_bridge.hpp"
#include "topoloc/camera/image_source.hpp"

#include <string>

#include <nlohmann/json.hpp>

namespace topoloc::apps {

nlohmann::json to_json(const camera::BridgeSummary& summary, const camera::ImageSource& source);
/// The same for people: two lines.
std::string to_text(const nlohmann::json& summary);

}  // namespace topoloc::apps
