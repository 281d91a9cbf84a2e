// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/fault_script.hpp"

#include "config/strict_node.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace topoloc::replay {
namespace {

using config::Range;
using config::StrictNode;

constexpr std::array<std::string_view, kFaultKindCount> kNames = {
    "can_dropout",      "can_burst",    "can_bit_errors",  "can_frozen",    "can_duplicate",
    "can_reorder",      "wheel_slip",   "camera_drop",     "camera_freeze", "camera_blackout",
    "camera_time_step", "camera_delay", "camera_elsewhere"};

constexpr Range kAnyTime_s = {-86400.0, 86400.0};
constexpr Range kShare = {0.0, 1.0, true};

std::int64_t to_ns(double seconds) { return std::llround(seconds * 1e9); }

std::vector<can::FrameId> find_messages(StrictNode& node, const FaultScript& script) {
  std::vector<std::string> names;
  node.read("messages", names);
  std::vector<can::FrameId> ids;
  for (const std::string& name : names) {
    const std::size_t before = ids.size();
    for (const can::Dbc& dbc : script.dbcs) {
      for (const can::Message& message : dbc.messages()) {
        if (message.name == name) {
          ids.push_back({message.id, message.extended});
        }
      }
    }
    if (ids.size() == before) {
      throw node.error("messages", "no DBC file of the vehicle has a message '" + name + "'");
    }
  }
  return ids;
}

can::SignalRef find_signal(const StrictNode& node, const FaultScript& script,
                           const std::string& name) {
  std::optional<std::string> complaint;
  for (const can::Dbc& dbc : script.dbcs) {
    try {
      return dbc.signal(name);
    } catch (const std::runtime_error& error) {
      complaint = complaint.value_or(error.what());
    }
  }
  throw node.error("signals", complaint.value_or("the vehicle has no DBC file"));
}

void read_signals(StrictNode& node, const FaultScript& script, std::vector<std::string> names,
                  Fault& fault) {
  node.read("signals", names);
  for (const std::string& name : names) {
    fault.signals.push_back(find_signal(node, script, name));
    const can::Message& message = *fault.signals.back().message;
    fault.ids.push_back({message.id, message.extended});
  }
}

void read_seconds(StrictNode& node, const char* key, std::int64_t& target_ns, Range range_s) {
  double seconds = 0.0;
  node.require(key, seconds, range_s);
  target_ns = to_ns(seconds);
}

Fault read_fault(StrictNode& node, const FaultScript& script,
                 const can::VehicleSignalsConfig& vehicle) {
  Fault fault;
  std::string kind;
  node.require("kind", kind, std::vector<std::string>(kNames.begin(), kNames.end()));
  fault.kind =
      static_cast<FaultKind>(std::find(kNames.begin(), kNames.end(), kind) - kNames.begin());
  std::int64_t duration_ns = 0;
  read_seconds(node, "at_s", fault.from_ns, {0.0, 1e6});
  read_seconds(node, "for_s", duration_ns, config::positive_up_to(1e6));
  fault.until_ns = fault.from_ns + duration_ns;

  switch (fault.kind) {
    case FaultKind::kCanFrozen:
      read_signals(node, script, {}, fault);
      break;
    case FaultKind::kWheelSlip:
      read_signals(node, script, vehicle.wheels.speeds, fault);
      if (fault.signals.empty()) {
        throw node.error("signals", "missing, and the vehicle has no wheel speeds");
      }
      node.require("factor", fault.factor, Range{-100.0, 100.0});
      break;
    case FaultKind::kCanBitErrors:
      node.read("bits", fault.count, Range{1, 512});
      break;
    case FaultKind::kCanReorder:
      node.read("by", fault.count, Range{1, 1000});
      break;
    case FaultKind::kCameraTimeStep:
      read_seconds(node, "step_s", fault.offset_ns, kAnyTime_s);
      break;
    case FaultKind::kCameraDelay:
      read_seconds(node, "delay_s", fault.offset_ns, config::positive_up_to(60.0));
      break;
    case FaultKind::kCameraElsewhere:
      read_seconds(node, "offset_s", fault.offset_ns, kAnyTime_s);
      break;
    default:
      break;
  }
  const bool whole_stream = fault.kind == FaultKind::kCanBurst ||
                            fault.kind == FaultKind::kCanFrozen ||
                            fault.kind == FaultKind::kWheelSlip;
  if (!whole_stream) {
    node.read("share", fault.share, kShare);
  }
  if (!concerns_camera(fault.kind)) {
    node.read("interface", fault.interface);
    if (fault.signals.empty()) {
      fault.ids = find_messages(node, script);
    }
  }
  node.finish();
  return fault;
}

}  // namespace

std::string_view name(FaultKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

bool concerns_camera(FaultKind kind) { return kind >= FaultKind::kCameraDrop; }

FaultScript load_fault_script(const std::filesystem::path& file,
                              const can::VehicleSignalsConfig& vehicle) {
  StrictNode top = StrictNode::load(file);
  int format = 0;
  top.require("format", format, Range{1, 1});
  int seed = 1;
  top.read("seed", seed, Range{0, 2e9});

  FaultScript script;
  script.seed = static_cast<std::uint64_t>(seed);
  for (const auto& dbc : vehicle.dbcs) {
    script.dbcs.push_back(can::Dbc::load(dbc));
  }
  script.checks = can::make_checks(vehicle.checks, script.dbcs);
  for (StrictNode& node : top.items("faults")) {
    script.faults.push_back(read_fault(node, script, vehicle));
  }
  top.finish();
  return script;
}

}  // namespace topoloc::replay
