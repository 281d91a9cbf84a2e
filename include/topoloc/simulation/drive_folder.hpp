// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <filesystem>
#include <functional>

namespace topoloc::simulation {

/// Whether a drive folder may be made here: the place is free, an empty folder or, with `force`, a
/// drive folder. Throws std::runtime_error that says why not.
void require_free(const std::filesystem::path& out, bool force);

/// Lets `fill` make the folder in a new one beside its place, OUT.partial-XXXXXX, then moves it:
/// `out` is there complete or not at all. Replaces what require_free() allows, then and before.
void create_folder(const std::filesystem::path& out, bool force,
                   const std::function<void(const std::filesystem::path&)>& fill);

}  // namespace topoloc::simulation
