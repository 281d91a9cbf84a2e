// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mounting_report.hpp"

#include <cmath>
#include <cstdio>
#include <ostream>

#include <nlohmann/json.hpp>

namespace {

using topoloc::evaluation::MountingEstimate;
using topoloc::evaluation::MountingVerdict;
using topoloc::evaluation::Parameter;

struct Column {
  const char* key;
  const char* title;
  Parameter MountingEstimate::*parameter;
  double factor;
};

constexpr double kDegrees = 180.0 / M_PI;

constexpr Column kColumns[] = {
    {"pitch_rad", "pitch [deg]", &MountingEstimate::pitch_rad, kDegrees},
    {"yaw_rad", "yaw [deg]", &MountingEstimate::yaw_rad, kDegrees},
    {"lever_x_m", "lever arm x [m]", &MountingEstimate::lever_x_m, 1.0},
    {"lever_y_m", "lever arm y [m]", &MountingEstimate::lever_y_m, 1.0},
    {"lever_z_m", "lever arm z [m]", &MountingEstimate::lever_z_m, 1.0},
    {"wheel_scale", "wheel scale", &MountingEstimate::wheel_scale, 1.0},
    {"wheel_delay_s", "wheel delay [ms]", &MountingEstimate::wheel_delay_s, 1e3},
    {"lever_x_without_slip_m", "lever arm x, slip apart [m]",
     &MountingEstimate::lever_x_without_slip_m, 1.0},
    {"slip_s2pm", "tyre slip [ms^2/m]", &MountingEstimate::slip_s2pm, 1e3},
};
constexpr std::size_t kDriveColumns = 3;  ///< those that every drive's row shows

std::string format(const char* pattern, double a, double b = 0.0) {
  char text[96];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size(), width), ' ');
  return text;
}

/// Standard deviation of a parameter's values between the drives that observe it; NaN below two.
double spread(const std::vector<MountingRow>& drives, const Column& column) {
  double n = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  for (const MountingRow& row : drives) {
    const Parameter& p = row.estimate.*column.parameter;
    if (row.refused.empty() && p.observable) {
      n += 1.0;
      sum += p.value;
      squares += p.value * p.value;
    }
  }
  return n < 2.0 ? std::nan("") : std::sqrt(std::max(0.0, (squares - sum * sum / n) / (n - 1.0)));
}

nlohmann::ordered_json to_object(const MountingRow& row) {
  nlohmann::ordered_json json;
  json["name"] = row.name;
  json["refused"] = row.refused;
  const MountingEstimate& e = row.estimate;
  json["samples"] = e.samples;
  json["too_slow"] = e.too_slow;
  json["turning_too_hard"] = e.turning_too_hard;
  for (const Column& column : kColumns) {
    const Parameter& p = e.*column.parameter;
    json[column.key] = {{"value", p.value}, {"std", p.std}, {"observable", p.observable}};
  }
  json["lateral_std_mps"] = e.lateral_std_mps;
  json["vertical_std_mps"] = e.vertical_std_mps;
  json["forward_std_mps"] = e.forward_std_mps;
  return json;
}

}  // namespace

std::string refusal(const MountingEstimate& estimate) {
  switch (estimate.verdict) {
    case MountingVerdict::kOk:
      return "";
    case MountingVerdict::kTooFewSamples:
      return "only " + std::to_string(estimate.samples) + " samples fast and straight enough";
    case MountingVerdict::kResidualsTooLarge:
      return format("residuals of %.2f m/s sideways and %.2f m/s upwards: the reference ",
                    estimate.lateral_std_mps, estimate.vertical_std_mps) +
             "contradicts itself";
  }
  return "";
}

void print_mounting(std::ostream& out, const std::vector<MountingRow>& drives,
                    const MountingRow& all) {
  constexpr std::size_t kNameWidth = 26;
  constexpr std::size_t kCellWidth = 20;
  out << padded("drive", kNameWidth) << padded("samples", 9);
  for (std::size_t i = 0; i < kDriveColumns; ++i) {
    out << padded(kColumns[i].title, kCellWidth);
  }
  out << "residual lat, up [m/s]\n";
  for (const MountingRow& row : drives) {
    out << padded(row.name, kNameWidth);
    if (!row.refused.empty()) {
      out << "refused: " << row.refused << '\n';
      continue;
    }
    out << padded(std::to_string(row.estimate.samples), 9);
    for (std::size_t i = 0; i < kDriveColumns; ++i) {
      const Parameter& p = row.estimate.*kColumns[i].parameter;
      const double f = kColumns[i].factor;
      out << padded(p.observable ? format("%+.3f +- %.3f", f * p.value, f * p.std)
                                 : format("(unobservable, %.1f)", f * p.std),
                    kCellWidth);
    }
    out << format("%.3f, %.3f", row.estimate.lateral_std_mps, row.estimate.vertical_std_mps)
        << '\n';
  }
  if (!all.refused.empty()) {
    return;
  }
  out << '\n'
      << padded(all.name, 30) << padded("value", 12) << padded("std", 10) << padded("spread", 10)
      << "observable\n";
  for (const Column& column : kColumns) {
    const Parameter& p = all.estimate.*column.parameter;
    if (p.std == 0.0) {
      continue;  // no wheel speeds
    }
    const double between = spread(drives, column);
    out << padded(column.title, 30) << padded(format("%+.4f", column.factor * p.value), 12)
        << padded(format("%.4f", column.factor * p.std), 10)
        << padded(std::isnan(between) ? "-" : format("%.4f", column.factor * between), 10)
        << (p.observable ? "yes" : "no: the given value stays") << '\n';
  }
  out << "roll stays as given: the direction of travel does not show it\n"
         "spread: standard deviation between the drives\n";
}

void print_imu_bias(std::ostream& out, const topoloc::evaluation::ImuBias& bias) {
  const auto print = [&](const char* what, const Eigen::Vector3d& v, const Eigen::Vector3d& std) {
    char text[160];
    std::snprintf(text, sizeof text, "%-30s%+.5f +- %.5f  %+.5f +- %.5f  %+.5f +- %.5f\n", what,
                  v.x(), std.x(), v.y(), std.y(), v.z(), std.z());
    out << text;
  };
  out << '\n';
  print("gyro bias x, y, z [rad/s]", bias.gyro_radps, bias.gyro_std_radps);
  print("accelerometer bias [m/s^2]", bias.accel_mps2, bias.accel_std_mps2);
}

std::string mounting_json(const std::vector<MountingRow>& drives, const MountingRow& all,
                          const topoloc::evaluation::ImuBias* bias) {
  nlohmann::ordered_json json = to_object(all);
  const auto& mounting = all.estimate.mounting;
  const auto list = [](const Eigen::Vector3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
  };
  json["vehicle"] = {{"rotation_vehicle_imu_rpy_rad", list(mounting.rotation_vehicle_imu_rpy_rad)},
                     {"wheel_reference_imu_m", list(mounting.wheel_reference_imu_m)},
                     {"wheel_scale", mounting.wheel_scale}};
  if (bias != nullptr) {
    json["imu"] = {{"gyro_bias_radps", list(bias->gyro_radps)},
                   {"gyro_bias_std_radps", list(bias->gyro_std_radps)},
                   {"accel_bias_mps2", list(bias->accel_mps2)},
                   {"accel_bias_std_mps2", list(bias->accel_std_mps2)}};
  }
  json["drives"] = nlohmann::ordered_json::array();
  for (const MountingRow& row : drives) {
    json["drives"].push_back(to_object(row));
  }
  return json.dump(2) + "\n";
}
