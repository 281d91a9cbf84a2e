// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/preflight.hpp"

#include "topoloc/can/can_receiver.hpp"
#include "topoloc/drive/drive.hpp"
#include "topoloc/live/journal.hpp"
#include "topoloc/live/last_pose.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/matching/map_matcher.hpp"
#include "topoloc/realtime/memory_lock.hpp"
#include "topoloc/realtime/thread.hpp"
#include "topoloc/transport/lcm_connection.hpp"

#include "live/receive_buffer.hpp"

#include <cstdlib>
#include <exception>
#include <functional>
#include <numeric>
#include <unistd.h>

#include <fmt/core.h>
#include <lcm/lcm-cpp.hpp>

namespace topoloc::live {
namespace {

/// Runs one check after the other; an exception is an error in its own words.
class Checklist {
 public:
  void run(const std::string& what, const std::function<Check()>& check) {
    Check result;
    try {
      result = check();
    } catch (const std::exception& e) {
      result = {.what = {}, .verdict = CheckVerdict::kError, .text = e.what()};
    }
    result.what = what;
    checks_.push_back(std::move(result));
  }

  [[nodiscard]] std::vector<Check> take() { return std::move(checks_); }

 private:
  std::vector<Check> checks_;
};

Check ok(std::string text) { return {.what = {}, .text = std::move(text)}; }
Check warning(std::string text) {
  return {.what = {}, .verdict = CheckVerdict::kWarning, .text = std::move(text)};
}
Check error(std::string text) {
  return {.what = {}, .verdict = CheckVerdict::kError, .text = std::move(text)};
}

Check check_interface(const can::CanReceiver& receiver, std::size_t i, int wanted_bytes) {
  const std::string& device = receiver.device(i);
  if (receiver.state(i) != can::CanState::kUp) {
    return warning(fmt::format(
        "{} is {}: frames come once it is up (ip link set {} up type can bitrate 500000, with the "
        "bit rate of the bus)",
        device, can::name(receiver.state(i)), device));
  }
  const int granted_bytes = receiver.buffer_bytes(i);
  if (granted_bytes < wanted_bytes) {
    return warning(fmt::format(
        "{}: the receive buffer has {} bytes instead of {}: raise net.core.rmem_max (sysctl -w "
        "net.core.rmem_max={}) or grant CAP_NET_ADMIN",
        device, granted_bytes, wanted_bytes, wanted_bytes));
  }
  return ok(fmt::format("{} is up, receive buffer of {} bytes", device, granted_bytes));
}

void check_can(const config::VehicleConfig& vehicle, Checklist& list) {
  std::optional<can::VehicleSignals> signals;
  list.run("CAN signals", [&] {
    signals.emplace(vehicle.can);
    return ok("found in the DBC files");
  });
  if (!signals) {
    return;
  }
  std::optional<can::CanReceiver> receiver;
  list.run("CAN interfaces", [&] {
    receiver.emplace(can::can_inputs(*signals, vehicle.live.can_interfaces),
                     can::CanReceiverOptions{.buffer_bytes = vehicle.live.can_buffer_bytes});
    return ok(fmt::format("{} opened", receiver->interface_count()));
  });
  for (std::size_t i = 0; receiver && i < receiver->interface_count(); ++i) {
    list.run(receiver->device(i),
             [&] { return check_interface(*receiver, i, vehicle.live.can_buffer_bytes); });
  }
}

Check check_lcm(const config::LiveConfig& live) {
  lcm::LCM lcm(live.lcm_url);
  transport::require_open(lcm, live.lcm_url);
  const ReceiveBuffer buffer = receive_buffer(live.lcm_url);
  if (buffer.is_udp && !buffer.wanted_bytes) {
    return warning(
        fmt::format("{}: without recv_buf_size most camera frames are lost: add "
                    "recv_buf_size=4000000 to live.lcm.url",
                    live.lcm_url));
  }
  if (buffer.is_udp && buffer.granted_bytes < *buffer.wanted_bytes) {
    return warning(
        fmt::format("the receive buffer has {} bytes instead of {}: camera frames will "
                    "be lost; raise the limit: sysctl -w net.core.rmem_max={}",
                    buffer.granted_bytes, *buffer.wanted_bytes, *buffer.wanted_bytes));
  }
  return ok(live.lcm_url);
}

Check check_map(const config::VehicleConfig& vehicle, const std::filesystem::path& file) {
  if (!vehicle.camera.configured()) {
    return error("a map is given, but the vehicle has no camera (section 'camera')");
  }
  const map::MapFile map(file);
  const config::KalibrCamera& camera = vehicle.camera.kalibr;
  const matching::MapMatcher matcher(vehicle.matching, map, camera.calibration, camera.T_imu_cam,
                                     drive::read_mask(vehicle.camera));
  std::size_t damaged = 0;
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    damaged += map.node_intact(i) ? 0 : 1;
  }
  if (damaged > 0) {
    return warning(
        fmt::format("{}: {} of {} nodes are damaged and will not be used: copy the map "
                    "again (topoloc-map verify tells more)",
                    file.string(), damaged, map.node_count()));
  }
  const bool has_band = matcher.least_effort() == matching::Effort::kBand;
  return ok(fmt::format("{}: {} nodes, made with {}, as configured{}", file.string(),
                        map.node_count(), map::to_string(map.info().model),
                        has_band ? ""
                                 : "; no model for half of the rows, so that less cannot "
                                   "be looked at where time is short"));
}

/// The folder, or the nearest one above it that is there.
std::filesystem::path existing_part(const std::filesystem::path& folder) {
  std::filesystem::path existing = folder.empty() ? "." : folder;
  while (!std::filesystem::exists(existing)) {
    existing = existing.has_parent_path() ? existing.parent_path() : ".";
  }
  return existing;
}

Check check_writable(const std::filesystem::path& folder, const std::string& key) {
  const std::filesystem::path existing = existing_part(folder);
  std::string trial = existing / ".topoloc-check-XXXXXX";
  const int file = mkstemp(trial.data());
  if (file >= 0) {
    close(file);
    unlink(trial.c_str());
  } else {
    return error(fmt::format("{}: cannot be written by this user: change its owner, or {}",
                             existing.string(), key));
  }
  return ok(folder.string());
}

Check check_journal(const config::LiveConfig& live) {
  Check writable = check_writable(live.journal, "live.journal.folder");
  if (writable.verdict != CheckVerdict::kOk) {
    return writable;
  }
  // That of the run before is kept, too.
  const std::uintmax_t wanted_mb = 2 * static_cast<std::uintmax_t>(live.journal_mb);
  std::uintmax_t to_be_replaced = 0;
  for (const auto& folder : {live.journal, live.journal / "previous"}) {
    for (const std::filesystem::path& file : journal_files(folder)) {
      to_be_replaced += std::filesystem::file_size(file);
    }
  }
  const std::uintmax_t free_mb =
      (std::filesystem::space(existing_part(live.journal)).available + to_be_replaced) >> 20;
  if (free_mb < wanted_mb) {
    return warning(
        fmt::format("{}: {} MB are free, up to {} MB are used: make room or lower "
                    "live.journal.max_mb",
                    live.journal.string(), free_mb, wanted_mb));
  }
  return writable;
}

Check check_last_pose(const std::filesystem::path& file) {
  if (!std::filesystem::is_directory(std::filesystem::absolute(file).parent_path())) {
    return error(file.string() + ": its folder is not there: make it");
  }
  Check writable = check_writable(file.parent_path(), "live.last_pose");
  if (writable.verdict != CheckVerdict::kOk) {
    return writable;
  }
  try {
    return ok(file.string() + (read_last_pose(file)
                                   ? ": will be started from"
                                   : ": none kept yet, an initial pose is needed"));
  } catch (const std::runtime_error& e) {  // a power cut while it was written
    return warning(std::string(e.what()) + ": not started from, an initial pose is needed");
  }
}

Check check_real_time(const config::LiveConfig& live) {
  const realtime::Thread thread(
      {.name = "check",
       .fifo_priority = live.priority,
       .cpus = live.cpu ? std::vector<int>{*live.cpu} : std::vector<int>{}},
      [] {});
  std::vector<std::string> complaints = thread.warnings();
  const realtime::MemoryLock lock = realtime::lock_memory();
  if (!lock.locked) {
    complaints.push_back(lock.warning);
  }
  realtime::unlock_memory();
  if (complaints.empty()) {
    return ok(fmt::format("SCHED_FIFO {}{}, memory can be locked", live.priority,
                          live.cpu ? fmt::format(", CPU {}", *live.cpu) : ""));
  }
  return warning(std::accumulate(
      std::next(complaints.begin()), complaints.end(), complaints.front(),
      [](const std::string& all, const std::string& one) { return all + "; " + one; }));
}

}  // namespace

const char* name(CheckVerdict verdict) {
  switch (verdict) {
    case CheckVerdict::kOk:
      return "ok";
    case CheckVerdict::kWarning:
      return "warning";
    case CheckVerdict::kError:
      return "error";
  }
  return "unknown";
}

std::vector<Check> preflight(const config::VehicleConfig& vehicle,
                             const std::optional<std::filesystem::path>& map) {
  const config::LiveConfig& live = vehicle.live;
  Checklist list;
  check_can(vehicle, list);
  list.run("LCM", [&] { return check_lcm(live); });
  if (map) {
    list.run("map and models", [&] { return check_map(vehicle, *map); });
  }
  if (!live.journal.empty()) {
    list.run("journal", [&] { return check_journal(live); });
  }
  if (!live.last_pose.empty()) {
    list.run("last pose", [&] { return check_last_pose(live.last_pose); });
  }
  list.run("real time", [&] { return check_real_time(live); });
  return list.take();
}

}  // namespace topoloc::live
