// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <ostream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace topoloc::evaluation {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

struct Row {
  const char* title;
  std::function<std::string(const EvaluatedEstimate&)> cell;
};

Row statistics_row(const char* title, Statistics PoseScores::*quantity, double Statistics::*figure,
                   const char* pattern) {
  return {title,
          [=](const EvaluatedEstimate& e) { return format(pattern, e.scores.*quantity.*figure); }};
}

Row signed_row(const char* title, int axis) {
  return {title, [axis](const EvaluatedEstimate& e) {
            return format("%+.3f", e.scores.signed_mean_m[axis]);
          }};
}

Row drift_row(const char* title, double PoseScores::*error_m) {
  return {title, [=](const EvaluatedEstimate& e) -> std::string {
            const double error = e.scores.*error_m;
            const double way = e.scores.travelled_m;
            return format("%.3f", error) +
                   (way > 0.0 ? format(" %.2f%%", 100.0 * error / way) : "");
          }};
}

Row nees_row(const char* title, Nees Consistency::*part) {
  return {title, [part](const EvaluatedEstimate& e) -> std::string {
            if (!e.consistency || e.consistency->steps == 0) {
              return "-";
            }
            const Nees& nees = (*e.consistency).*part;
            return format("%.2f", nees.mean) + format(" [%.2f", nees.lower) +
                   format(" %.2f]", nees.upper) + format(" %.0f%%", 100.0 * nees.inside_share);
          }};
}

std::vector<Row> table_rows() {
  using S = PoseScores;
  using Q = Statistics;
  return {
      {"reference poses",
       [](const EvaluatedEstimate& e) { return std::to_string(e.scores.reference_poses); }},
      {"matched", [](const EvaluatedEstimate& e) { return std::to_string(e.scores.matched); }},
      {"coverage", [](const EvaluatedEstimate& e) { return format("%.4f", e.scores.coverage); }},
      statistics_row("APEt: position, mean [m]", &S::position_m, &Q::mean, "%.3f"),
      statistics_row("  median [m]", &S::position_m, &Q::median, "%.3f"),
      statistics_row("  rmse [m]", &S::position_m, &Q::rmse, "%.3f"),
      statistics_row("  95 % [m]", &S::position_m, &Q::p95, "%.3f"),
      statistics_row("  max [m]", &S::position_m, &Q::max, "%.3f"),
      statistics_row("APEr: rotation, mean [rad]", &S::rotation_rad, &Q::mean, "%.5f"),
      {"  mean [deg]",
       [](const EvaluatedEstimate& e) {
         return format("%.3f", e.scores.rotation_rad.mean * kDegrees);
       }},
      statistics_row("  95 % [rad]", &S::rotation_rad, &Q::p95, "%.5f"),
      statistics_row("  max [rad]", &S::rotation_rad, &Q::max, "%.5f"),
      statistics_row("longitudinal, mean absolute [m]", &S::longitudinal_m, &Q::mean, "%.3f"),
      signed_row("  mean signed (+ ahead) [m]", 0),
      statistics_row("  95 % [m]", &S::longitudinal_m, &Q::p95, "%.3f"),
      statistics_row("lateral, mean absolute [m]", &S::lateral_m, &Q::mean, "%.3f"),
      signed_row("  mean signed (+ left) [m]", 1),
      statistics_row("  95 % [m]", &S::lateral_m, &Q::p95, "%.3f"),
      statistics_row("vertical, mean absolute [m]", &S::vertical_m, &Q::mean, "%.3f"),
      signed_row("  mean signed (+ up) [m]", 2),
      {"travelled [m]",
       [](const EvaluatedEstimate& e) { return format("%.1f", e.scores.travelled_m); }},
      drift_row("horizontal, max [m, % of way]", &S::max_horizontal_m),
      drift_row("  at the end [m, % of way]", &S::final_horizontal_m),
      {"time offset (+ ahead) [ms]",
       [](const EvaluatedEstimate& e) {
         return e.scores.time_offset_s ? format("%+.1f", 1e3 * *e.scores.time_offset_s) : "-";
       }},
  };
}

std::vector<Row> consistency_rows() {
  return {
      {"states judged",
       [](const EvaluatedEstimate& e) {
         return e.consistency ? std::to_string(e.consistency->steps) : "-";
       }},
      {"states without positive covariance",
       [](const EvaluatedEstimate& e) {
         return e.consistency ? std::to_string(e.consistency->not_positive_definite) : "-";
       }},
      nees_row("ANEES attitude (3)", &Consistency::attitude),
      nees_row("ANEES position (3)", &Consistency::position),
      nees_row("ANEES pose (6)", &Consistency::pose),
  };
}

/// States are sorted by time: the one nearest to a stamp, if near enough.
const StateEstimate* nearest_state(const std::vector<StateEstimate>& states, std::int64_t time_ns,
                                   std::int64_t max_gap_ns) {
  const auto after = std::lower_bound(
      states.begin(), states.end(), time_ns,
      [](const StateEstimate& state, std::int64_t time) { return state.time_ns < time; });
  const StateEstimate* best = nullptr;
  std::int64_t best_gap_ns = max_gap_ns;
  for (auto it = after == states.begin() ? after : std::prev(after);
       it != states.end() && it <= after; ++it) {
    const std::int64_t gap_ns = std::abs(it->time_ns - time_ns);
    if (gap_ns <= best_gap_ns) {
      best = &*it;
      best_gap_ns = gap_ns;
    }
  }
  return best;
}

/// Text as a CSV field.
std::string quoted(const std::string& text) {
  std::string field = "\"";
  for (const char c : text) {
    field += c == '"' ? "\"\"" : std::string(1, c);
  }
  return field + '"';
}

nlohmann::ordered_json to_object(const Nees& nees) {
  return {{"dof", nees.dof},
          {"anees", nees.mean},
          {"lower_95", nees.lower},
          {"upper_95", nees.upper},
          {"inside_share", nees.inside_share}};
}

nlohmann::ordered_json to_object(const EvaluatedEstimate& estimate) {
  const PoseScores& s = estimate.scores;
  nlohmann::ordered_json json;
  json["label"] = estimate.label;
  json["apet_m"] = s.position_m.mean;
  json["aper_rad"] = s.rotation_rad.mean;
  json["longitudinal_m"] = s.longitudinal_m.mean;
  json["lateral_m"] = s.lateral_m.mean;
  json["vertical_m"] = s.vertical_m.mean;
  json["longitudinal_signed_m"] = s.signed_mean_m.x();
  json["lateral_signed_m"] = s.signed_mean_m.y();
  json["vertical_signed_m"] = s.signed_mean_m.z();
  json["longitudinal_p95_m"] = s.longitudinal_m.p95;
  json["lateral_p95_m"] = s.lateral_m.p95;
  json["vertical_p95_m"] = s.vertical_m.p95;
  json["max_longitudinal_m"] = s.longitudinal_m.max;
  json["max_lateral_m"] = s.lateral_m.max;
  json["rmse_position_m"] = s.position_m.rmse;
  json["median_position_m"] = s.position_m.median;
  json["p95_position_m"] = s.position_m.p95;
  json["max_position_m"] = s.position_m.max;
  json["rmse_rotation_rad"] = s.rotation_rad.rmse;
  json["median_rotation_rad"] = s.rotation_rad.median;
  json["p95_rotation_rad"] = s.rotation_rad.p95;
  json["max_rotation_rad"] = s.rotation_rad.max;
  json["max_horizontal_m"] = s.max_horizontal_m;
  json["final_horizontal_m"] = s.final_horizontal_m;
  json["travelled_m"] = s.travelled_m;
  json["time_offset_s"] =
      s.time_offset_s ? nlohmann::ordered_json(*s.time_offset_s) : nlohmann::ordered_json();
  json["coverage"] = s.coverage;
  json["matched"] = s.matched;
  json["reference_poses"] = s.reference_poses;
  json["begin_ns"] = estimate.matched.begin_ns;
  if (estimate.consistency) {
    const Consistency& c = *estimate.consistency;
    json["consistency"] = {{"steps", c.steps},
                           {"outside_reference", c.outside_reference},
                           {"not_positive_definite", c.not_positive_definite},
                           {"attitude", to_object(c.attitude)},
                           {"position", to_object(c.position)},
                           {"pose", to_object(c.pose)}};
  }
  return json;
}

}  // namespace

void print_table(std::ostream& out, const std::vector<EvaluatedEstimate>& estimates) {
  std::vector<Row> rows = table_rows();
  const bool has_states = std::any_of(estimates.begin(), estimates.end(),
                                      [](const auto& e) { return e.consistency.has_value(); });
  if (has_states) {
    const std::vector<Row> more = consistency_rows();
    rows.insert(rows.end(), more.begin(), more.end());
  }
  rows.insert(rows.begin(), {"", [](const EvaluatedEstimate& e) { return e.label; }});

  std::size_t title_width = 0;
  for (const Row& row : rows) {
    title_width = std::max(title_width, std::string(row.title).size());
  }
  std::vector<std::size_t> widths;
  for (const EvaluatedEstimate& estimate : estimates) {
    std::size_t width = 0;
    for (const Row& row : rows) {
      width = std::max(width, row.cell(estimate).size());
    }
    widths.push_back(width);
  }
  for (const Row& row : rows) {
    std::string line = row.title;
    line.resize(title_width, ' ');
    for (std::size_t i = 0; i < estimates.size(); ++i) {
      const std::string cell = row.cell(estimates[i]);
      line += "  " + std::string(widths[i] - cell.size(), ' ') + cell;
    }
    out << line << '\n';
  }
  if (has_states) {
    out << "ANEES: mean [95 % interval of the mean of independent steps] steps inside their own "
           "95 %\n";
  }
}

std::string to_json(const std::vector<EvaluatedEstimate>& estimates) {
  if (estimates.size() == 1) {
    return to_object(estimates.front()).dump(2) + "\n";
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const EvaluatedEstimate& estimate : estimates) {
    list.push_back(to_object(estimate));
  }
  return nlohmann::ordered_json{{"estimates", list}}.dump(2) + "\n";
}

void write_errors_csv(const std::filesystem::path& path,
                      const std::vector<EvaluatedEstimate>& estimates, std::int64_t max_gap_ns) {
  const auto close = [](std::FILE* file) { return std::fclose(file); };
  std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "wb"), close);
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot open for writing");
  }
  std::fputs(
      "label,time_ns,reference_x_m,reference_y_m,estimate_x_m,estimate_y_m,longitudinal_m,"
      "lateral_m,vertical_m,roll_rad,pitch_rad,yaw_rad,longitudinal_std_m,lateral_std_m,"
      "vertical_std_m,roll_std_rad,pitch_std_rad,yaw_std_rad\n",
      file.get());
  for (const EvaluatedEstimate& estimate : estimates) {
    const std::string label = quoted(estimate.label);
    for (const PoseError& error : estimate.matched.errors) {
      const auto& p_reference = error.T_world_reference.p;
      const auto& p_estimate = error.T_world_estimate.p;
      const auto& e = error.heading_error_m;
      const auto& theta = error.rotation_error_rad;
      std::fprintf(file.get(), "%s,%lld,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.8f,%.8f,%.8f",
                   label.c_str(), static_cast<long long>(error.time_ns), p_reference.x(),
                   p_reference.y(), p_estimate.x(), p_estimate.y(), e.x(), e.y(), e.z(), theta.x(),
                   theta.y(), theta.z());
      if (const StateEstimate* state = nearest_state(estimate.states, error.time_ns, max_gap_ns)) {
        const Eigen::Matrix3d R_world_heading = heading_axes(error.T_world_reference.R);
        const Eigen::Vector3d p_std =
            (R_world_heading.transpose() * state->covariance.bottomRightCorner<3, 3>() *
             R_world_heading)
                .diagonal()
                .cwiseMax(0.0)
                .cwiseSqrt();
        const Eigen::Vector3d theta_std =
            state->covariance.diagonal().head<3>().cwiseMax(0.0).cwiseSqrt();
        std::fprintf(file.get(), ",%.6f,%.6f,%.6f,%.8f,%.8f,%.8f\n", p_std.x(), p_std.y(),
                     p_std.z(), theta_std.x(), theta_std.y(), theta_std.z());
      } else {
        std::fputs(",,,,,,\n", file.get());
      }
    }
  }
  const bool failed = std::ferror(file.get()) != 0;
  if (std::fclose(file.release()) != 0 || failed) {
    throw std::runtime_error(path.string() + ": write error");
  }
}

}  // namespace topoloc::evaluation
