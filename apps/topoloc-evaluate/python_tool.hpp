// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <string>
#include <vector>

namespace topoloc::apps {

/// Runs tools/NAME of the source tree with the project's Python environment in place of this
/// program, so that signals and exit code are the tool's. It finds the programs beside this one by
/// TOPOLOC_BIN, unless that is set already. Throws std::runtime_error where it cannot be started.
[[noreturn]] void become_python_tool(const std::string& name,
                                     const std::vector<std::string>& arguments);

/// The same beside this program: waits for it. Returns its exit code; 1 where a signal ended it,
/// 127 where it could not be started.
int run_python_tool(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace topoloc::apps
