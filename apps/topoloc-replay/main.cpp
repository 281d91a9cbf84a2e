// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/can_sender.hpp"
#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/drive/drive.hpp"
#include "topoloc/replay/player.hpp"
#include "topoloc/transport/lcm_connection.hpp"

#include "common/text_file.hpp"
#include "summary.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <pthread.h>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <lcm/lcm-cpp.hpp>

namespace {

namespace can = topoloc::can;
namespace drive = topoloc::drive;
namespace replay = topoloc::replay;

constexpr const char* kExamples = R"(
Examples:
  topoloc-replay --drive drives/monday --can vcan0 --lcm "udpm://239.255.76.67:7667?ttl=0"
  topoloc-replay --drive drives/monday --can can0=vcan0 --can imu0=vcan1 --speed 0.5
  tools/with-vcan topoloc-replay --drive drives/monday --can vcan0 --faults faults.yaml

Image stamps become the present, with the same distance to the CAN frames as recorded; the stamps of
CAN frames are the receiver's. Fault scripts: docs/replay.md. Ctrl-C ends it with the summary.
Exit code: 0 done, 1 failed, 2 wrong usage.)";

struct Options {
  std::filesystem::path drive;
  std::vector<std::string> can;
  std::string lcm;
  std::string channel;
  double speed = 1.0;
  bool loop = false;
  double start_s = 0.0;
  double duration_s = 0.0;
  std::string frames = "all";
  std::filesystem::path faults;
  int fifo = 0;
  std::string json;
};

std::atomic<bool> stop_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

/// The interfaces of the log and where their frames go.
class CanOutput {
 public:
  CanOutput(const std::vector<std::string>& options, const replay::CanLogSummary& log,
            const std::string& log_file) {
    std::string in_log;
    for (const auto& [interface, count] : log.frames) {
      in_log += (in_log.empty() ? "" : ", ") + interface;
    }
    for (const std::string& option : options) {
      const std::size_t equals = option.find('=');
      if (equals == std::string::npos && log.frames.size() > 1) {
        throw std::runtime_error(fmt::format(
            "{}: has frames of several interfaces ({}): say where each goes, --can {}={}", log_file,
            in_log, log.frames.begin()->first, option));
      }
      const std::string interface =
          equals == std::string::npos ? log.frames.begin()->first : option.substr(0, equals);
      const std::string device = equals == std::string::npos ? option : option.substr(equals + 1);
      if (!log.frames.contains(interface)) {
        throw std::runtime_error(fmt::format("{}: no frame of interface '{}' (there are: {})",
                                             log_file, interface, in_log));
      }
      if (!senders_.emplace(interface, std::make_unique<can::CanSender>(device)).second) {
        throw std::runtime_error("--can: interface '" + interface + "' of the log is there twice");
      }
    }
  }

  can::SendVerdict send(const can::Frame& frame) {
    const auto found = senders_.find(frame.interface());
    return found == senders_.end() ? can::SendVerdict::kNotSupported : found->second->send(frame);
  }
  [[nodiscard]] bool has(const std::string& interface) const {
    return senders_.contains(interface);
  }

 private:
  std::map<std::string, std::unique_ptr<can::CanSender>, std::less<>> senders_;
};

void set_priority(int fifo) {
  const sched_param parameter = {.sched_priority = fifo};
  if (fifo > 0) {
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
        error != 0) {
      fmt::print(stderr, "topoloc-replay: warning: no real-time priority: {}\n",
                 std::generic_category().message(error));
    }
  }
}

void run(const Options& options) {
  const drive::FrameSelection selection = drive::parse_frame_selection(options.frames);
  drive::Drive folder;
  folder.dir = options.drive;
  folder.vehicle = topoloc::config::load_vehicle_config(options.drive / "vehicle.yaml");
  const replay::FaultScript script =
      options.faults.empty() ? replay::FaultScript{}
                             : replay::load_fault_script(options.faults, folder.vehicle.can);

  const std::filesystem::path log_file = options.drive / "can.log";
  const double duration_s =
      options.duration_s > 0.0 ? options.duration_s : std::numeric_limits<double>::infinity();
  const replay::CanLogSummary log =
      replay::summarise_can_log(log_file, options.start_s, duration_s);
  std::optional<CanOutput> output;
  if (!options.can.empty()) {
    output.emplace(options.can, log, log_file.string());
    for (const auto& [interface, count] : log.frames) {
      if (!output->has(interface)) {
        fmt::print(stderr, "topoloc-replay: warning: the frames of {} are not played\n", interface);
      }
    }
  }
  std::optional<drive::FrameLog> images;
  std::optional<lcm::LCM> lcm;
  if (!options.lcm.empty()) {
    images.emplace(drive::open_frames(folder));
    lcm.emplace(options.lcm);
    topoloc::transport::require_open(*lcm, options.lcm);
  }

  replay::DrivePart part;
  part.begin_ns = log.first_ns + std::llround(options.start_s * 1e9);
  part.end_ns = log.last_ns + 1;
  if (images) {
    const auto last = images->message(images->size() - 1);
    part.end_ns = std::max(part.end_ns, replay::arrival_ns(last) + 1);
  }
  if (options.duration_s > 0.0) {
    part.end_ns =
        std::min(part.end_ns, part.begin_ns + std::int64_t{std::llround(options.duration_s * 1e9)});
  }
  part.loop = options.loop;
  fmt::print("playing {:.1f} s of {}{}\n", 1e-9 * static_cast<double>(part.end_ns - part.begin_ns),
             options.drive.string(), options.loop ? ", again and again" : "");
  std::fflush(stdout);

  replay::CanFaults can_faults(script);
  std::optional<replay::CameraTrack> camera_track;
  std::optional<replay::CameraFaults> camera_faults;
  std::optional<replay::CameraPlayed> camera_played;
  std::optional<replay::CanPlayed> can_played;
  if (images) {
    camera_track.emplace(*images, part, selection);
    camera_faults.emplace(
        script, [&](std::int64_t elapsed_ns) { return camera_track->message_at(elapsed_ns); });
  }
  const std::string channel =
      options.channel.empty() ? folder.vehicle.camera.channel : options.channel;
  const replay::Pacer pacer(options.speed);
  const std::int64_t start_unix_ns = pacer.unix_ns(0);
  std::exception_ptr camera_failure;
  {
    std::jthread camera_thread;
    if (images) {
      camera_thread = std::jthread([&] {
        try {
          set_priority(options.fifo);
          camera_played = replay::play_camera(
              *camera_track, *camera_faults,
              [&](std::span<const std::byte> message) {
                return lcm->publish(channel, message.data(),
                                    static_cast<unsigned>(message.size())) == 0;
              },
              pacer, stop_requested);
        } catch (...) {
          camera_failure = std::current_exception();
          stop_requested = true;
        }
      });
    }
    if (output) {
      set_priority(options.fifo);
      replay::CanTrack track(log_file, part);
      can_played = replay::play_can(
          track, can_faults, [&](const can::Frame& frame) { return output->send(frame); }, pacer,
          stop_requested);
    }
  }
  if (camera_failure) {
    std::rethrow_exception(camera_failure);
  }

  nlohmann::json summary =
      topoloc::apps::to_json({.script = &script,
                              .can_faults = output ? &can_faults : nullptr,
                              .camera_faults = camera_faults ? &*camera_faults : nullptr,
                              .can = can_played ? &*can_played : nullptr,
                              .camera = camera_played ? &*camera_played : nullptr});
  summary["start"] = {{"recorded_ns", part.begin_ns}, {"unix_ns", start_unix_ns}};
  if (part.loop) {
    summary["lap_ns"] = part.lap_ns();
  }
  summary["malformed_lines"] = log.malformed;
  if (images) {
    summary["rejected_images"] = images->rejected();
  }
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, summary.dump(2) + "\n");
  }
  if (options.json != "-") {
    fmt::print("{}", topoloc::apps::to_text(summary));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Plays a recorded drive in real time onto CAN interfaces and LCM."};
  app.footer(kExamples);
  app.set_version_flag("--version", TOPOLOC_VERSION);
  Options options;
  app.add_option("--drive", options.drive, "Drive folder (docs/drive-folder.md)")->required();
  auto* can_option =
      app.add_option("--can", options.can,
                     "CAN interface, or INTERFACE_OF_THE_LOG=INTERFACE; once for each")
          ->take_all()
          ->expected(1);
  auto* lcm_option = app.add_option("--lcm", options.lcm, "LCM URL to publish the images on");
  app.add_option("--channel", options.channel, "LCM channel; default: the one of vehicle.yaml");
  app.add_option("--speed", options.speed, "Times as fast as recorded")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  app.add_flag("--loop", options.loop,
               "Play it again and again: stamps go on, the place as the drive has it");
  app.add_option("--start-seconds", options.start_s, "Start so long after the first CAN frame")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--duration", options.duration_s, "Play so many seconds of the drive; 0: all")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--frames", options.frames, "Images to play, by their place in the log")
      ->check(CLI::IsMember({"all", "even", "odd"}))
      ->capture_default_str();
  app.add_option("--faults", options.faults, "Fault script (docs/replay.md)");
  app.add_option("--fifo", options.fifo, "Real-time priority (SCHED_FIFO) of the players; 0: none")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
  app.add_option("--json", options.json, "Write the summary as JSON to this file, - for stdout");
  try {
    app.parse(argc, argv);
    if (can_option->count() == 0 && lcm_option->count() == 0) {
      throw CLI::RequiredError("--can or --lcm");
    }
    for (const int number : {SIGINT, SIGTERM}) {
      std::signal(number, [](int) { stop_requested = true; });
    }
    run(options);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::Error& e) {
    app.exit(e);
    return 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "topoloc-replay: {}\n", e.what());
    return 1;
  }
}
