// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/mounting.hpp"

#include "mounting_report.hpp"

#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace {

namespace fs = std::filesystem;
using namespace topoloc::evaluation;

/// Above this the positions of an INS contradict its velocity: it has not converged.
constexpr double kMaxSpeedDisagreement_mps = 1.5;

struct Options {
  std::vector<std::string> oxts;
  std::string vehicle;
  std::string out;
  std::string json;
  MountingOptions mounting;
};

std::string read_text(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot read");
  }
  return text.str();
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot write");
  }
}

std::string drive_name(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.'));
}

void calibrate_vehicle(const Options& options) {
  std::vector<MountingRow> rows;
  std::vector<MotionSample> pooled;
  for (const std::string& path : options.oxts) {
    const OxtsDrive drive = read_oxts(path);
    MountingRow row{drive_name(path), estimate_mounting(drive.samples, options.mounting), ""};
    row.refused = refusal(row.estimate);
    if (drive.speed_disagreement_mps > kMaxSpeedDisagreement_mps) {
      char text[128];
      std::snprintf(text, sizeof text,
                    "stated and travelled speed differ by %.1f m/s: INS not converged",
                    drive.speed_disagreement_mps);
      row.refused = text;
    }
    if (row.refused.empty()) {
      pooled.insert(pooled.end(), drive.samples.begin(), drive.samples.end());
    }
    rows.push_back(row);
  }
  MountingRow all{rows.size() == 1 ? rows.front().name : "all drives",
                  estimate_mounting(pooled, options.mounting), ""};
  all.refused = refusal(all.estimate);
  if (options.json == "-") {
    std::cout << mounting_json(rows, all);
  } else {
    print_mounting(std::cout, rows, all);
    if (!options.json.empty()) {
      write_text(options.json, mounting_json(rows, all));
    }
  }
  if (!all.refused.empty()) {
    throw std::runtime_error("no calibration: " +
                             (pooled.empty() ? "every drive was refused" : all.refused));
  }
  if (!options.out.empty()) {
    try {
      write_text(options.out, with_mounting(read_text(options.vehicle), all.estimate.mounting));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(options.vehicle + ": " + error.what());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Calibration from recorded drives with a reference.");
  app.set_version_flag("--version", TOPOLOC_VERSION);
  app.require_subcommand(1);
  CLI::App& vehicle = *app.add_subcommand(
      "vehicle",
      "IMU-to-vehicle rotation (pitch, yaw), lever arm of the wheel reference point, wheel scale");
  vehicle
      .add_option("--oxts", options.oxts,
                  "GNSS/INS rows in KITTI's OXTS columns, CSV or CSV.gz; several are pooled")
      ->required()
      ->check(CLI::ExistingFile);
  auto* base = vehicle.add_option("--vehicle", options.vehicle, "vehicle.yaml to start from")
                   ->check(CLI::ExistingFile);
  vehicle
      .add_option("--out", options.out,
                  "Write --vehicle with the calibrated 'vehicle:' section; all else is kept")
      ->needs(base);
  vehicle.add_option("--json", options.json, "Write JSON to a file, or '-' instead of the table");
  vehicle
      .add_option("--min-speed", options.mounting.min_speed_mps, "Slower samples are left out, m/s")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 50.0));
  vehicle
      .add_option("--max-lateral-acceleration", options.mounting.max_lateral_acceleration_mps2,
                  "Harder turns are left out (tyres slip), m/s^2")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 20.0));
  vehicle.footer(
      "Examples:\n"
      "  topoloc-calibrate vehicle --oxts drives/2011_09_26_*.csv.gz\n"
      "  topoloc-calibrate vehicle --oxts a.csv.gz b.csv.gz --vehicle vehicle.yaml \\\n"
      "      --out calibrated.yaml\n\n"
      "Exit code: 0 done, 1 failed or refused, 2 wrong usage.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    calibrate_vehicle(options);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "topoloc-calibrate: " << error.what() << '\n';
    return 1;
  }
}
