// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/tick.hpp"

#include <optional>
#include <topoloc/journal_start_t.hpp>
#include <topoloc/match_set_t.hpp>
#include <topoloc/tick_t.hpp>

/// Ticks and match sets as LCM messages and back, bit for bit.
namespace topoloc::live {

/// Reuses the message's memory.
void to_message(const TickInput& tick, tick_t& message);
void to_message(const NumberedMatchSet& set, match_set_t& message);

void set_pose(const std::optional<estimation::InitialPose>& pose, journal_start_t& message);
std::optional<estimation::InitialPose> pose_of(const journal_start_t& message);

/// False where a message holds more than a tick or a match set can.
bool from_message(const tick_t& message, TickInput& tick);
bool from_message(const match_set_t& message, NumberedMatchSet& set);

}  // namespace topoloc::live
