// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/report.hpp"

#include "common/run_app.hpp"
#include "common/text_file.hpp"
#include "topoloc-evaluate/python_tool.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace {

namespace fs = std::filesystem;
using namespace topoloc::evaluation;
using topoloc::apps::become_python_tool;
using topoloc::apps::run_python_tool;

struct Options {
  std::string reference;
  std::vector<std::string> estimates;
  std::vector<std::string> labels;
  std::vector<std::string> states;
  double from_s = 0.0;
  double max_gap_s = 0.2;
  std::string json;
  std::string errors;
  std::string plots;
};

/// The states that topoloc-localise writes beside EST.tum.
std::optional<fs::path> states_of(const Options& options, std::size_t i) {
  if (!options.states.empty()) {
    return options.states[i];
  }
  const fs::path sibling = beside(options.estimates[i], ".states.csv");
  return fs::exists(sibling) ? std::optional(sibling) : std::nullopt;
}

EvaluatedEstimate evaluate(const Options& options, const Trajectory& reference, std::size_t i) {
  const auto max_gap_ns = static_cast<std::int64_t>(std::llround(options.max_gap_s * 1e9));
  EvaluatedEstimate result;
  result.label =
      options.labels.empty() ? fs::path(options.estimates[i]).stem().string() : options.labels[i];
  const Trajectory estimate = read_tum(options.estimates[i]);
  try {
    result.matched = match_errors(reference, estimate, {options.from_s, max_gap_ns});
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(options.estimates[i] + " against " + options.reference + ": " +
                             error.what());
  }
  result.scores = score(result.matched);
  if (const auto path = states_of(options, i)) {
    result.states = read_states(*path);
    result.consistency = consistency(reference, result.states, result.matched.begin_ns, max_gap_ns);
  }
  return result;
}

/// Draws the plots of DIR/errors.csv.
void plot(const fs::path& dir) {
  const std::string csv = (dir / "errors.csv").string();
  int exit_code = 0;
  try {
    exit_code = run_python_tool("plot_evaluation.py", {csv, "--out", dir.string()});
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("no plots: " + std::string(error.what()) + "; the errors are in " +
                             csv);
  }
  if (exit_code != 0) {
    throw std::runtime_error("no plots: plot_evaluation.py failed; the errors are in " + csv);
  }
}

void run(const Options& options) {
  const Trajectory reference = read_tum(options.reference);
  std::vector<EvaluatedEstimate> estimates;
  for (std::size_t i = 0; i < options.estimates.size(); ++i) {
    estimates.push_back(evaluate(options, reference, i));
  }
  if (options.json != "-") {
    print_table(std::cout, estimates);
  }
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, to_json(estimates));
  }
  const auto max_gap_ns = static_cast<std::int64_t>(std::llround(options.max_gap_s * 1e9));
  if (!options.errors.empty()) {
    write_errors_csv(options.errors, estimates, max_gap_ns);
  }
  if (!options.plots.empty()) {
    fs::create_directories(options.plots);
    write_errors_csv(fs::path(options.plots) / "errors.csv", estimates, max_gap_ns);
    plot(options.plots);
  }
}

/// The scenario suite; its options are read by the tool itself.
int suite(const std::vector<std::string>& arguments) {
  try {
    become_python_tool("suite.py", arguments);
  } catch (const std::exception& error) {
    std::cerr << "topoloc-evaluate suite: " << error.what() << '\n';
    return topoloc::apps::kFailed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (!arguments.empty() && arguments.front() == "suite") {
    return suite({arguments.begin() + 1, arguments.end()});
  }
  Options options;
  CLI::App app(
      "Absolute pose errors of estimated trajectories against a reference. Never aligns: the map "
      "frame is the reference.");
  app.set_version_flag("--version", TOPOLOC_VERSION);
  app.add_option("--reference", options.reference, "True trajectory (TUM)")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--estimate", options.estimates, "Estimated trajectory (TUM); may be repeated")
      ->required()
      ->allow_extra_args(false)
      ->check(CLI::ExistingFile);
  app.add_option("--label", options.labels,
                 "Name of an estimate in table and plots, one per --estimate [its file name]")
      ->allow_extra_args(false);
  app.add_option("--states", options.states,
                 "States with covariance, one per --estimate [EST.states.csv where it exists]")
      ->allow_extra_args(false)
      ->check(CLI::ExistingFile);
  app.add_option("--from-seconds", options.from_s,
                 "Count only from this many seconds after the reference begins")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e9));
  app.add_option("--max-gap-s", options.max_gap_s,
                 "The estimate is not interpolated across longer gaps")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--json", options.json,
                 "Write the figures as JSON to a file, or '-' instead of "
                 "the table");
  app.add_option("--errors", options.errors, "Write the errors at every matched stamp (CSV)");
  app.add_option("--plots", options.plots, "Folder for errors.csv and PNG plots");
  app.footer(
      "longitudinal_m and lateral_m are means of absolute errors in the true heading;\n"
      "longitudinal_signed_m (+ ahead) and lateral_signed_m (+ left) keep the sign.\n"
      "coverage = share of the reference stamps at which the estimate has a pose.\n\n"
      "topoloc-evaluate suite: simulates, maps, localises and evaluates whole scenarios and "
      "writes\n"
      "one report; see topoloc-evaluate suite --help.\n\n"
      "Examples:\n"
      "  topoloc-evaluate --reference ground_truth.tum --estimate est.tum --from-seconds 2\n"
      "  topoloc-evaluate --reference ground_truth.tum --estimate est.tum --json - | jq .apet_m\n"
      "  topoloc-evaluate --reference gt.tum --estimate a.tum --label 'nodes 5 m' \\\n"
      "      --estimate b.tum --label 'nodes 20 m' --plots plots\n\n"
      "Exit code: 0 done, 1 failed, 2 wrong usage.");
  return topoloc::apps::run_app(app, "topoloc-evaluate", argc, argv, [&] {
    const auto check_count = [&options](const std::vector<std::string>& list, const char* name) {
      if (!list.empty() && list.size() != options.estimates.size()) {
        throw CLI::ValidationError(name, "give one per --estimate, or none");
      }
    };
    check_count(options.labels, "--label");
    check_count(options.states, "--states");
    run(options);
    return topoloc::apps::kDone;
  });
}
