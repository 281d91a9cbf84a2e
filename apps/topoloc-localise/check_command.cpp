// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/preflight.hpp"

#include "commands.hpp"
#include "common/initial_pose.hpp"
#include "common/text_file.hpp"
#include "vehicle_options.hpp"

#include <algorithm>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace topoloc::apps {

int check_vehicle(const Options& options) {
  if (!options.initial_pose.empty()) {
    (void)parse_initial_pose(options.initial_pose);
  }
  const config::VehicleConfig vehicle = load_vehicle(options);
  const std::vector<live::Check> checks =
      live::preflight(vehicle, options.dead_reckoning ? std::nullopt : std::optional(options.map));
  nlohmann::json figures = nlohmann::json::array();
  for (const live::Check& check : checks) {
    figures.push_back(
        {{"what", check.what}, {"verdict", live::name(check.verdict)}, {"text", check.text}});
    if (options.json != "-") {
      fmt::print("{:<8} {}: {}\n", live::name(check.verdict), check.what, check.text);
    }
  }
  if (!options.json.empty()) {
    write_text(options.json, figures.dump(2) + "\n");
  }
  const bool runs = std::none_of(checks.begin(), checks.end(), [](const live::Check& check) {
    return check.verdict == live::CheckVerdict::kError;
  });
  return runs ? 0 : 1;
}

}  // namespace topoloc::apps
