// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "config/sections.hpp"

namespace topoloc::config {
namespace {

void read_path(StrictNode& node, const char* key, std::filesystem::path& target) {
  std::string name;
  node.read(key, name);
  if (!name.empty()) {
    target = node.resolve(name);
  }
}

}  // namespace

void read_live(StrictNode& top, LiveConfig& config) {
  StrictNode live = top.section("live");
  live.read("rate_hz", config.rate_hz, {10.0, 1000.0});
  live.read("priority", config.priority, {0, 99});
  if (live.has("cpu")) {
    live.read("cpu", config.cpu.emplace(), {0, 1023});
  }
  live.read("latency_budget_s", config.latency_budget_s, {0.01, 10.0});
  read_path(live, "last_pose", config.last_pose);

  StrictNode can = live.section("can");
  can.read("interfaces", config.can_interfaces);
  can.read("buffer_bytes", config.can_buffer_bytes, {4096, 1 << 28});
  can.finish();

  StrictNode lcm = live.section("lcm");
  lcm.read("url", config.lcm_url);
  StrictNode channels = lcm.section("channels");
  channels.read_or_none("estimate", config.channels.estimate);
  channels.read_or_none("pose", config.channels.pose);
  channels.read_or_none("geo_pose", config.channels.geo_pose);
  channels.read_or_none("status", config.channels.status);
  channels.read_or_none("timing", config.channels.timing);
  channels.read_or_none("initial_pose", config.channels.initial_pose);
  channels.read_or_none("command", config.channels.command);
  channels.finish();
  lcm.finish();

  StrictNode journal = live.section("journal");
  read_path(journal, "folder", config.journal);
  journal.read("max_mb", config.journal_mb, {1, 1 << 20});
  journal.finish();
  live.finish();
}

}  // namespace topoloc::config
