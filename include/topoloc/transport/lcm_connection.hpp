// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <string>

#include <lcm/lcm-cpp.hpp>

namespace topoloc::transport {

/// Throws std::runtime_error that names the address it was made with and says what to do where LCM
/// could not be opened there.
void require_open(lcm::LCM& lcm, const std::string& url);

}  // namespace topoloc::transport
