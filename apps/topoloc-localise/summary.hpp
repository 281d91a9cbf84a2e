// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/localiser/batch.hpp"

#include <nlohmann/json.hpp>

/// Figures of a run. `frames`: of the drive; null for dead reckoning.
nlohmann::json summary(const topoloc::drive::Drive& drive, const topoloc::drive::FrameLog* frames,
                       const topoloc::localiser::BatchResult& result);
