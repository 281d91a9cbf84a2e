// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <CLI/CLI.hpp>

/// The subcommands of topoloc-map, one file each. A callback throws CLI::RuntimeError(1) when it
/// has told the user what is wrong, any other std::exception to have main() tell it.
void add_build_command(CLI::App& app);
void add_inspect_command(CLI::App& app);
void add_verify_command(CLI::App& app);
void add_strip_command(CLI::App& app);
