// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/drive_spec.hpp"

#include <filesystem>

namespace topoloc::simulation {

/// vehicle.yaml, camchain.yaml, imu.yaml and the DBC: what the user of the car knows of it, not the
/// truth. Throw std::runtime_error that names the file.
void write_vehicle_files(const std::filesystem::path& folder, const DriveSpec& spec);

}  // namespace topoloc::simulation
