// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/imu_bias.hpp"
#include "topoloc/evaluation/mounting.hpp"

#include <iosfwd>
#include <string>
#include <vector>

/// Estimate of one drive, or of several together.
struct MountingRow {
  std::string name;
  topoloc::evaluation::MountingEstimate estimate;
  std::string refused;  ///< why this drive was not used; empty: it was
};

/// Why an estimate is no good, in words; empty if it is.
std::string refusal(const topoloc::evaluation::MountingEstimate& estimate);

/// A row per drive, spread between the drives, then the parameters of the last row (all drives
/// together, or the only one) with their standard deviations.
void print_mounting(std::ostream& out, const std::vector<MountingRow>& drives,
                    const MountingRow& all);

void print_imu_bias(std::ostream& out, const topoloc::evaluation::ImuBias& bias);

/// `bias` may be null.
std::string mounting_json(const std::vector<MountingRow>& drives, const MountingRow& all,
                          const topoloc::evaluation::ImuBias* bias);
