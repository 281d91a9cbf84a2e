// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/consistency.hpp"
#include "topoloc/evaluation/pose_errors.hpp"

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

/// What topoloc-evaluate hands out (docs/evaluation.md describes every figure).
namespace topoloc::evaluation {

/// One estimate judged against the reference.
struct EvaluatedEstimate {
  std::string label;
  MatchedErrors matched;
  PoseScores scores;
  std::vector<StateEstimate> states;       ///< with covariance; empty: none known
  std::optional<Consistency> consistency;  ///< present if there are states
};

/// Table for people: a row per figure, a column per estimate.
void print_table(std::ostream& out, const std::vector<EvaluatedEstimate>& estimates);

/// JSON object of one estimate; of several: {"estimates": [{"label": ..., ...}, ...]}.
std::string to_json(const std::vector<EvaluatedEstimate>& estimates);

/// CSV with the error at every matched reference stamp, and the standard deviations that the
/// nearest state (at most max_gap_ns away) claims, empty where none is known.
/// Throws std::runtime_error on I/O errors.
void write_errors_csv(const std::filesystem::path& path,
                      const std::vector<EvaluatedEstimate>& estimates, std::int64_t max_gap_ns);

}  // namespace topoloc::evaluation
