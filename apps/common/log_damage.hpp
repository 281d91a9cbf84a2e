// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/transport/lcm_log.hpp"

#include <string>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace topoloc::apps {

inline nlohmann::json to_json(const transport::LogDamage& damage) {
  return {{"corrupt_regions", damage.corrupt_regions},
          {"skipped_bytes", damage.skipped_bytes},
          {"truncated", damage.truncated},
          {"first", damage.first}};
}

/// A line about what is broken in the log; empty if it is sound.
inline std::string to_text(const transport::LogDamage& damage) {
  if (damage.first.empty()) {
    return {};
  }
  return fmt::format("damaged log: {} corrupt regions, {} bytes left out{}; first: {}\n",
                     damage.corrupt_regions, damage.skipped_bytes,
                     damage.truncated ? ", cut off at its end" : "", damage.first);
}

}  // namespace topoloc::apps
