// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <exception>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

namespace topoloc::apps {

/// Exit codes of all programs but where a command says more of its own.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;

/// Parses the command line, then runs `body()`, which returns an exit code and may throw CLI errors
/// for wrong usage. Errors go to stderr with the program's name.
template <typename Body>
int run_app(CLI::App& app, const std::string& program, int argc, char** argv, Body&& body) {
  try {
    app.parse(argc, argv);
    return body();
  } catch (const CLI::RuntimeError& e) {  // a subcommand's own exit code
    return e.get_exit_code();
  } catch (const CLI::RequiredError& e) {
    // It only says that a command is missing; a word that is none is what it means.
    const auto any = [](const CLI::App* /*command*/) { return true; };
    if (app.get_subcommands().empty() && !app.get_subcommands(any).empty() &&
        !app.remaining().empty()) {
      std::cerr << program << ": unknown command '" << app.remaining().front()
                << "' (--help lists them)\n";
      return kUsage;
    }
    app.exit(e);
    return kUsage;
  } catch (const CLI::Error& e) {  // --help and --version among them
    return app.exit(e) == 0 ? kDone : kUsage;
  } catch (const std::exception& e) {
    std::cerr << program << ": " << e.what() << '\n';
    return kFailed;
  }
}

}  // namespace topoloc::apps
