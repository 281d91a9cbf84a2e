// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/trajectory.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace topoloc::evaluation {
namespace {

constexpr int kTumColumns = 8;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr double kQuaternionNormTolerance = 0.01;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Tokens separated by blanks; at most one more than the columns of a TUM line.
std::vector<std::string_view> blank_separated(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<std::string_view> tokens;
  while (tokens.size() <= kTumColumns) {
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) {
      break;
    }
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    tokens.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
  return tokens;
}

std::optional<double> parse_finite(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

/// Pose of one line; throws a message without the place.
StampedPose parse_pose(const std::vector<std::string_view>& tokens) {
  if (tokens.size() != kTumColumns) {
    throw std::runtime_error("found " +
                             std::string(tokens.size() < kTumColumns
                                             ? std::to_string(tokens.size()) + " columns"
                                             : "more columns") +
                             ", expected 8: t tx ty tz qx qy qz qw");
  }
  StampedPose pose;
  const auto time_ns = parse_seconds_ns(tokens[0]);
  if (!time_ns) {
    throw std::runtime_error("time '" + std::string(tokens[0]) + "' is not a number of seconds");
  }
  pose.time_ns = *time_ns;
  std::array<double, kTumColumns - 1> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = parse_finite(tokens[i + 1]);
    if (!value) {
      throw std::runtime_error("'" + std::string(tokens[i + 1]) + "' is not a finite number");
    }
    v[i] = *value;
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!(std::abs(q.norm() - 1.0) <= kQuaternionNormTolerance)) {
    throw std::runtime_error("quaternion norm is " + std::to_string(q.norm()) +
                             ", expected 1 (columns qx qy qz qw)");
  }
  pose.T_world_imu = RigidTransform::from_quaternion({v[0], v[1], v[2]}, q);
  return pose;
}

}  // namespace

std::optional<std::int64_t> parse_seconds_ns(std::string_view text) {
  bool negative = false;
  if (text.starts_with('-') || text.starts_with('+')) {
    negative = text.front() == '-';
    text.remove_prefix(1);
  }
  // Digits without the point, and the power of ten of the last one in nanoseconds.
  std::string digits;
  std::size_t at = 0;
  int exponent = 9;
  bool after_point = false;
  for (; at < text.size() && (is_digit(text[at]) || (text[at] == '.' && !after_point)); ++at) {
    if (text[at] == '.') {
      after_point = true;
    } else {
      digits.push_back(text[at]);
      exponent -= after_point ? 1 : 0;
    }
  }
  if (digits.empty() || digits.size() > 100) {
    return std::nullopt;
  }
  if (at < text.size()) {
    if (text[at] != 'e' && text[at] != 'E') {
      return std::nullopt;
    }
    ++at;
    at += at < text.size() && text[at] == '+' ? 1 : 0;
    int power = 0;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), power);
    if (error != std::errc{} || end != text.data() + text.size() || std::abs(power) > 100) {
      return std::nullopt;
    }
    exponent += power;
  }
  bool round_up = false;
  for (; exponent < 0 && !digits.empty(); ++exponent) {
    round_up = digits.back() >= '5';
    digits.pop_back();
  }
  round_up = round_up && exponent == 0;
  std::int64_t ns = 0;
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  const auto append = [&ns](int digit) {
    if (ns > (kMax - digit) / 10) {
      return false;
    }
    ns = ns * 10 + digit;
    return true;
  };
  for (const char digit : digits) {
    if (!append(digit - '0')) {
      return std::nullopt;
    }
  }
  for (; exponent > 0 && ns != 0; --exponent) {
    if (!append(0)) {
      return std::nullopt;
    }
  }
  ns += round_up && ns < kMax ? 1 : 0;
  return negative ? -ns : ns;
}

Trajectory read_tum(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot open trajectory");
  }
  Trajectory trajectory;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const auto tokens = blank_separated(line);
    if (tokens.empty() || tokens.front().starts_with('#')) {
      continue;
    }
    try {
      const StampedPose pose = parse_pose(tokens);
      if (!trajectory.empty() && pose.time_ns <= trajectory.back().time_ns) {
        throw std::runtime_error("time does not increase (" + std::string(tokens[0]) + ")");
      }
      trajectory.push_back(pose);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path.string() + ":" + std::to_string(number) + ": " + error.what());
    }
  }
  if (file.bad()) {
    throw std::runtime_error(path.string() + ": read error");
  }
  if (trajectory.empty()) {
    throw std::runtime_error(path.string() + ": no poses in the trajectory");
  }
  return trajectory;
}

TumWriter::TumWriter(std::filesystem::path path)
    : path_(std::move(path)), file_(path_, std::ios::binary) {
  if (!file_) {
    throw std::runtime_error(path_.string() + ": cannot open for writing");
  }
  file_ << "# t[s] tx ty tz[m] qx qy qz qw (T_world_imu)\n";
}

void TumWriter::write(const StampedPose& pose) {
  if (!pose.T_world_imu.R.allFinite() || !pose.T_world_imu.p.allFinite()) {
    throw std::runtime_error(path_.string() + ": pose at " + std::to_string(pose.time_ns) +
                             " ns is not finite");
  }
  Eigen::Quaterniond q = pose.T_world_imu.quaternion();
  if (q.w() < 0.0) {
    q.coeffs() = -q.coeffs();
  }
  const Eigen::Vector3d& p = pose.T_world_imu.p;
  const std::int64_t seconds = pose.time_ns / kNsPerSecond;
  const std::int64_t rest_ns = std::abs(pose.time_ns % kNsPerSecond);
  std::array<char, 512> line{};
  const int length = std::snprintf(
      line.data(), line.size(), "%s%lld.%09lld %.6f %.6f %.6f %.9f %.9f %.9f %.9f\n",
      pose.time_ns < 0 ? "-" : "", static_cast<long long>(std::abs(seconds)),
      static_cast<long long>(rest_ns), p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  if (length <= 0 || static_cast<std::size_t>(length) >= line.size()) {
    throw std::runtime_error(path_.string() + ": pose at " + std::to_string(pose.time_ns) +
                             " ns cannot be written as text");
  }
  file_.write(line.data(), length);
}

void TumWriter::close() {
  file_.close();
  if (!file_) {
    throw std::runtime_error(path_.string() + ": write error");
  }
}

void write_tum(const std::filesystem::path& path, const Trajectory& trajectory) {
  TumWriter writer(path);
  for (const StampedPose& pose : trajectory) {
    writer.write(pose);
  }
  writer.close();
}

std::filesystem::path beside(const std::filesystem::path& trajectory, std::string_view suffix) {
  std::filesystem::path path = trajectory;
  if (path.extension() == ".tum") {
    path.replace_extension();
  }
  path += suffix;
  return path;
}

std::optional<RigidTransform> pose_at(const Trajectory& trajectory, std::int64_t time_ns,
                                      std::int64_t max_gap_ns) {
  const auto after = std::lower_bound(
      trajectory.begin(), trajectory.end(), time_ns,
      [](const StampedPose& pose, std::int64_t time) { return pose.time_ns < time; });
  if (after == trajectory.end()) {
    return std::nullopt;
  }
  if (after->time_ns == time_ns) {
    return after->T_world_imu;
  }
  if (after == trajectory.begin()) {
    return std::nullopt;
  }
  const auto before = std::prev(after);
  const std::int64_t gap_ns = after->time_ns - before->time_ns;
  if (gap_ns > max_gap_ns) {
    return std::nullopt;
  }
  const double fraction =
      static_cast<double>(time_ns - before->time_ns) / static_cast<double>(gap_ns);
  return interpolate(before->T_world_imu, after->T_world_imu, fraction);
}

}  // namespace topoloc::evaluation
