// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/pose_journal.hpp"

#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace topoloc::mapping {
namespace {

using nlohmann::json;

json numbers(std::span<const double> values) {
  json out = json::array();
  for (const double value : values) {
    out.push_back(value);  // printed so that it is read back to the last bit
  }
  return out;
}

void read_numbers(const json& in, std::span<double> values) {
  if (in.size() != values.size()) {
    throw std::runtime_error("not as many numbers as a pose has");
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = in.at(i).get<double>();
  }
}

json pose_json(const RefinedPose& pose) {
  json figures = json::object();
  for (const auto& [name, value] : pose.figures) {
    if (std::isfinite(value)) {
      figures[name] = value;
    }
  }
  return {{"frame", pose.frame},
          {"time_ns", pose.time_ns},
          {"R", numbers({pose.T_world_imu.R.data(), 9})},
          {"p", numbers({pose.T_world_imu.p.data(), 3})},
          {"covariance", numbers({pose.covariance.data(), 36})},
          {"rejected", pose.rejected ? json(name(*pose.rejected)) : json()},
          {"figures", figures}};
}

RefinedPose parse_pose(const json& in) {
  RefinedPose pose;
  pose.frame = in.at("frame").get<std::size_t>();
  pose.time_ns = in.at("time_ns").get<std::int64_t>();
  read_numbers(in.at("R"), {pose.T_world_imu.R.data(), 9});
  read_numbers(in.at("p"), {pose.T_world_imu.p.data(), 3});
  read_numbers(in.at("covariance"), {pose.covariance.data(), 36});
  if (!in.at("rejected").is_null()) {
    pose.rejected = reject_named(in.at("rejected").get<std::string>());
    if (!pose.rejected) {
      throw std::runtime_error("unknown reason of rejection");
    }
  }
  pose.figures = in.at("figures").get<Figures>();
  return pose;
}

}  // namespace

std::string poses_text(const std::vector<RefinedPose>& poses, const std::string& settings) {
  json list = json::array();
  for (const RefinedPose& pose : poses) {
    list.push_back(pose_json(pose));
  }
  return json{{"settings", settings}, {"poses", list}}.dump();
}

std::optional<std::vector<RefinedPose>> parse_poses(std::string_view text,
                                                    const std::string& settings) {
  try {
    const json in = json::parse(text);
    if (in.at("settings").get<std::string>() != settings) {
      return std::nullopt;
    }
    std::vector<RefinedPose> poses;
    for (const json& pose : in.at("poses")) {
      poses.push_back(parse_pose(pose));
    }
    return poses;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace topoloc::mapping
