// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/drive_spec.hpp"
#include "topoloc/simulation/simulate.hpp"

#include <string>

namespace topoloc::simulation {

/// scenario.json: everything that the drive was made with, the truth that its other files do not
/// tell among it.
std::string scenario_json(const DriveSpec& spec, const DriveSummary& summary);

}  // namespace topoloc::simulation
