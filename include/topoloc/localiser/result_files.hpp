// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/localiser/batch.hpp"

#include <filesystem>

namespace topoloc::localiser {

/// Files beside a trajectory EST.tum.
std::filesystem::path states_path(const std::filesystem::path& trajectory);   ///< EST.states.csv
std::filesystem::path updates_path(const std::filesystem::path& trajectory);  ///< EST.updates.csv

/// Poses T_world_imu of all ticks as TUM.
void write_trajectory(const std::filesystem::path& file, const BatchResult& result);

/// All ticks: full state, mode and pose covariance (upper triangle, order theta [rad, IMU axes],
/// p [m, world axes]). docs/evaluation.md describes the columns.
void write_states(const std::filesystem::path& file, const BatchResult& result);

/// All frames: matching and update figures.
void write_updates(const std::filesystem::path& file, const BatchResult& result);

}  // namespace topoloc::localiser
