// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/route.hpp"
#include "topoloc/world/world.hpp"

namespace topoloc::world {

/// A road as long as the spec says. Its heading stays within a quarter turn of east, so that it
/// never meets itself.
Route plan_route(const WorldSpec& spec);

}  // namespace topoloc::world
