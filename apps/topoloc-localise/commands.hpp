// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// What topoloc-localise can do; main.cpp reads the options.
namespace topoloc::apps {

struct Options {
  // Batch: a recorded drive.
  std::filesystem::path drive;
  std::filesystem::path vehicle;
  std::filesystem::path out;
  std::string frames = "all";
  double start_s = 0.0;
  bool no_speed = false;
  double match_delay_s = 0.0;
  int match_effort = 0;
  double match_seconds = 0.0;
  std::string json;
  // Live: the vehicle process.
  std::filesystem::path config;
  bool check = false;
  std::vector<std::string> can;
  std::string lcm_url;
  std::filesystem::path journal;
  std::filesystem::path last_pose;
  // Replay of a journal; with `config` and `out`.
  std::filesystem::path replay;
  // Batch and live.
  std::filesystem::path map;
  std::string initial_pose;
  bool dead_reckoning = false;
};

void localise_drive(const Options& options);
void replay_journal(const Options& options);
/// Returns the exit code.
int check_vehicle(const Options& options);
/// Until SIGTERM, SIGINT or an LCM command. Returns the exit code.
int localise_live(const Options& options);

}  // namespace topoloc::apps
