// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"
#include "topoloc/can/vehicle_signals.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Drives played in real time, and what may go wrong with them (docs/replay.md).
namespace topoloc::replay {

enum class FaultKind : std::uint8_t {
  kCanDropout,       ///< frames are not sent
  kCanBurst,         ///< frames are held back and sent all at once at the end
  kCanBitErrors,     ///< bits of payloads flip
  kCanFrozen,        ///< payloads, or signals in them, keep their last value
  kCanDuplicate,     ///< frames are sent twice
  kCanReorder,       ///< frames are overtaken by those after them
  kWheelSlip,        ///< speed signals are scaled
  kCameraDrop,       ///< images are not sent
  kCameraFreeze,     ///< the last image again and again, with new stamps
  kCameraBlackout,   ///< black images
  kCameraTimeStep,   ///< stamps are wrong by a constant
  kCameraDelay,      ///< images come later, their stamps stay
  kCameraElsewhere,  ///< images of another part of the drive
};
inline constexpr std::size_t kFaultKindCount = 13;
/// As in fault scripts: "can_dropout".
std::string_view name(FaultKind kind);
bool concerns_camera(FaultKind kind);

struct Fault {
  FaultKind kind = FaultKind::kCanDropout;
  std::int64_t from_ns = 0;             ///< since the start of the replay, in drive time
  std::int64_t until_ns = 0;            ///< not included
  std::vector<can::FrameId> ids;        ///< of frames concerned; empty: all
  std::string interface;                ///< as in the log; empty: any
  std::vector<can::SignalRef> signals;  ///< points into FaultScript::dbcs
  double share = 1.0;                   ///< of frames or images concerned, chosen at random
  int count = 1;               ///< kCanBitErrors: bits a frame; kCanReorder: overtaken by so many
  double factor = 1.0;         ///< kWheelSlip
  std::int64_t offset_ns = 0;  ///< kCameraTimeStep, kCameraDelay, kCameraElsewhere

  [[nodiscard]] bool active(std::int64_t elapsed_ns) const {
    return elapsed_ns >= from_ns && elapsed_ns < until_ns;
  }
};

struct FaultScript {
  std::uint64_t seed = 1;
  std::vector<Fault> faults;  ///< in the order of the file
  std::vector<can::Dbc> dbcs;
  /// Of the vehicle's messages: checksums are made right again where a signal was changed.
  std::vector<can::MessageCheck> checks;

  FaultScript() = default;
  FaultScript(FaultScript&&) = default;
  FaultScript& operator=(FaultScript&&) = default;
  FaultScript(const FaultScript&) = delete;
  FaultScript& operator=(const FaultScript&) = delete;
};

/// Reads a fault script. Messages and signals are those of the vehicle's DBC files. Throws
/// config::ConfigError with file, line and key.
FaultScript load_fault_script(const std::filesystem::path& file,
                              const can::VehicleSignalsConfig& vehicle);

}  // namespace topoloc::replay
