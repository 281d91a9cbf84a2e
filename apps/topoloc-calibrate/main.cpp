// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/relocated.hpp"
#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/evaluation/mounting.hpp"

#include "common/run_app.hpp"
#include "common/text_file.hpp"
#include "drive_motion.hpp"
#include "mounting_report.hpp"

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
using topoloc::apps::write_text;

/// Above this the positions of an INS contradict its velocity: it has not converged.
constexpr double kMaxSpeedDisagreement_mps = 1.5;

struct Options {
  std::vector<std::string> oxts;
  std::string drive;
  double until_s = 0.0;
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

std::string drive_name(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.'));
}

void write_vehicle(const Options& options, const Mounting& mounting, const ImuBias* bias) {
  const fs::path base = options.vehicle.empty() ? fs::path(options.drive) / "vehicle.yaml"
                                                : fs::path(options.vehicle);
  try {
    std::string text = with_mounting(read_text(base), mounting);
    if (bias != nullptr) {
      text = with_imu_bias(text, *bias);
    }
    const fs::path out = fs::absolute(options.out);
    write_text(
        out, topoloc::config::relocated(text, fs::absolute(base).parent_path(), out.parent_path()));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(base.string() + ": " + error.what());
  }
}

void report(const Options& options, const std::vector<MountingRow>& rows, const MountingRow& all,
            const ImuBias* bias) {
  if (!options.json.empty()) {
    write_text(options.json, mounting_json(rows, all, bias));
  }
  if (options.json == "-") {
    return;
  }
  print_mounting(std::cout, rows, all);
  if (bias != nullptr) {
    print_imu_bias(std::cout, *bias);
  }
}

void calibrate_with_drive(const Options& options) {
  const DriveMotion motion = read_drive_motion(options.drive, options.vehicle, options.until_s);
  MountingOptions mounting = options.mounting;
  mounting.given = motion.given;
  MountingRow row{fs::canonical(options.drive).filename().string(),
                  estimate_mounting(motion.samples, mounting), ""};
  row.refused = refusal(row.estimate);
  const ImuBias* bias = motion.imu_bias.windows > 0 ? &motion.imu_bias : nullptr;
  report(options, {row}, row, bias);
  if (!row.refused.empty()) {
    throw std::runtime_error("no calibration: " + row.refused);
  }
  if (!options.out.empty()) {
    write_vehicle(options, row.estimate.mounting, bias);
  }
}

void calibrate_with_oxts(const Options& options) {
  MountingOptions mounting = options.mounting;
  if (!options.vehicle.empty()) {
    const auto vehicle = topoloc::config::load_vehicle_config(options.vehicle);
    mounting.given = mounting_of(vehicle.estimator.models.speed);
  }
  std::vector<MountingRow> rows;
  std::vector<MotionSample> pooled;
  for (const std::string& path : options.oxts) {
    const OxtsDrive drive = read_oxts(path);
    MountingRow row{drive_name(path), estimate_mounting(drive.samples, mounting), ""};
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
                  estimate_mounting(pooled, mounting), ""};
  all.refused = refusal(all.estimate);
  report(options, rows, all, nullptr);
  if (!all.refused.empty()) {
    throw std::runtime_error("no calibration: " +
                             (pooled.empty() ? "every drive was refused" : all.refused));
  }
  if (!options.out.empty()) {
    write_vehicle(options, all.estimate.mounting, nullptr);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Calibration from recorded drives with a reference.");
  app.set_version_flag("--version", TOPOLOC_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  topoloc-calibrate vehicle --oxts drives/2011_09_26_*.csv.gz\n"
      "  topoloc-calibrate vehicle --drive drives/monday --out drives/monday/calibrated.yaml\n"
      "  topoloc-calibrate vehicle --help");
  CLI::App& vehicle = *app.add_subcommand(
      "vehicle",
      "IMU-to-vehicle rotation (pitch, yaw), lever arm of the wheel reference point, wheel scale");
  CLI::Option_group& source = *vehicle.add_option_group("source", "One of");
  source
      .add_option("--oxts", options.oxts,
                  "GNSS/INS rows in KITTI's OXTS columns, CSV or CSV.gz; several are pooled")
      ->check(CLI::ExistingFile);
  auto* drive = source
                    .add_option("--drive", options.drive,
                                "Drive folder with ground_truth.tum: also wheel speeds and the "
                                "biases of the IMU")
                    ->check(CLI::ExistingDirectory);
  source.require_option(1);
  vehicle
      .add_option("--until-seconds", options.until_s,
                  "Use the reference only so long after the drive's first inertial sample")
      ->needs(drive)
      ->check(CLI::Range(4.0, 1e6));
  vehicle
      .add_option("--vehicle", options.vehicle, "vehicle.yaml to start from; default: the drive's")
      ->check(CLI::ExistingFile);
  vehicle.add_option("--out", options.out,
                     "Write the vehicle.yaml with the calibrated keys of its sections 'vehicle' "
                     "and, with --drive, 'imu'; all else is kept, paths name the same files");
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
      "      --out calibrated.yaml\n"
      "  topoloc-calibrate vehicle --drive drives/monday --until-seconds 10 \\\n"
      "      --out drives/monday/calibrated.yaml\n\n"
      "Exit code: 0 done, 1 failed or refused, 2 wrong usage.");
  return topoloc::apps::run_app(app, "topoloc-calibrate", argc, argv, [&] {
    if (!options.out.empty() && options.drive.empty() && options.vehicle.empty()) {
      throw CLI::RequiresError("--out", "--vehicle or --drive");
    }
    if (!options.drive.empty()) {
      calibrate_with_drive(options);
    } else {
      calibrate_with_oxts(options);
    }
    return topoloc::apps::kDone;
  });
}
