// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <CLI/CLI.hpp>

/// A number within limits. CLI::Range lets nan through, which is not less than anything.
CLI::Validator number_within(double least, double most);

/// Digits of a number of 64 bit. CLI11 takes -1 for 2^64 - 1, cuts off what is too large, and reads
/// 010 as 8.
CLI::Validator whole_number();
