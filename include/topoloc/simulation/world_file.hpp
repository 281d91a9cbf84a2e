// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/world.hpp"

#include <filesystem>

namespace topoloc::simulation {

/// Worlds that are made in another way than those of this version are other worlds: raised where
/// the same description no longer gives the same world.
inline constexpr int kWorldVersion = 5;

/// Writes world.yaml of a drive folder: what its world is made from.
void write_world_file(const std::filesystem::path& file, const world::WorldSpec& spec);

/// Reads it. Throws config::ConfigError with file, line and key, also where the world was made by
/// another version.
world::WorldSpec read_world_file(const std::filesystem::path& file);

}  // namespace topoloc::simulation
