// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/replay/player.hpp"

#include <string>

#include <nlohmann/json.hpp>

namespace topoloc::apps {

/// What was played; either half may be left out.
struct Played {
  const replay::FaultScript* script = nullptr;
  const replay::CanFaults* can_faults = nullptr;
  const replay::CameraFaults* camera_faults = nullptr;
  const replay::CanPlayed* can = nullptr;
  const replay::CameraPlayed* camera = nullptr;
};

nlohmann::json to_json(const Played& played);
/// The same for people.
std::string to_text(const nlohmann::json& summary);

}  // namespace topoloc::apps
