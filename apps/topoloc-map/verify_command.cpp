// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"

#include "commands.hpp"
#include "common/progress_bar.hpp"

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
namespace {

using topoloc::map::VerifyProblem;
using topoloc::map::VerifyReport;

constexpr std::uint64_t kLongWork_bytes = 500'000'000;

void run(const std::filesystem::path& path) {
  std::optional<topoloc::apps::ProgressBar> bar;
  const VerifyReport report =
      topoloc::map::verify(path, [&bar](std::uint64_t done, std::uint64_t total) {
        if (total > kLongWork_bytes) {
          if (!bar) {
            bar.emplace("verify");
          }
          bar->update(static_cast<double>(done) / static_cast<double>(total));
        }
      });
  bar.reset();
  if (report.ok()) {
    std::cout << path.string() << ": ok, " << report.node_count << " nodes\n";
    return;
  }
  for (const VerifyProblem& problem : report.problems) {
    std::cerr << "topoloc-map: ";
    if (problem.section == "file") {
      std::cerr << problem.what << '\n';
    } else {
      std::cerr << path.string() << ": section " << problem.section << ", byte " << problem.offset
                << ": " << problem.what << '\n';
    }
  }
  if (report.problems.size() == VerifyReport::kMaxProblems) {
    std::cerr << "topoloc-map: there may be more: only the first " << VerifyReport::kMaxProblems
              << " problems are listed\n";
  }
  throw CLI::RuntimeError(1);
}

}  // namespace

void add_verify_command(CLI::App& app) {
  const auto path = std::make_shared<std::filesystem::path>();
  CLI::App* const command = app.add_subcommand("verify", "Reads every byte of a map and checks it");
  command->add_option("map", *path, "Map to check")->required();
  command->footer(
      "Exit code 0: intact; 1: damaged, with section and byte of each problem on stderr.\n"
      "Example:\n"
      "  topoloc-map verify town.tmap");
  command->callback([path] { run(*path); });
}
