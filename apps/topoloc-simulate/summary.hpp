// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/simulate.hpp"

#include <string>

std::string to_text(const topoloc::simulation::DriveSummary& summary);
std::string to_json(const topoloc::simulation::DriveRequest& request,
                    const topoloc::simulation::DriveSummary& summary);
