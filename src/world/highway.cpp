// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/world_maker.hpp"

namespace topoloc::world {
void make_highway(Maker&, const Section&) {}
}  // namespace topoloc::world
