// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

namespace topoloc::can {

/// What happened on a CAN interface since it was opened. Nothing is lost without a trace here.
struct CanCounters {
  std::uint64_t frames = 0;        ///< handed out
  std::uint64_t dropped = 0;       ///< by the kernel: the socket's buffer was full (SO_RXQ_OVFL)
  std::uint64_t error_frames = 0;  ///< from the controller; the kinds below overlap
  std::uint64_t bus_off = 0;       ///< the controller has left the bus
  std::uint64_t restarted = 0;     ///< and has come back
  std::uint64_t controller_warnings = 0;   ///< many errors: warning level or error passive
  std::uint64_t controller_overflows = 0;  ///< the controller lost frames, or could not send
  std::uint64_t other_errors = 0;          ///< error frames of any other kind
  std::uint64_t went_down = 0;             ///< the interface was set down
  std::uint64_t disappeared = 0;           ///< the interface was deleted or unplugged
  std::uint64_t came_back = 0;             ///< up again, or there again and bound anew
  std::uint64_t failed_rebinds = 0;        ///< attempts to bind to an interface that is back
  std::uint64_t read_errors = 0;           ///< any other error of a read
  std::uint64_t malformed = 0;             ///< neither a CAN nor a CAN FD frame
  std::uint64_t hardware_stamps = 0;       ///< frames with the controller's time, not the kernel's
  std::uint64_t missing_stamps = 0;        ///< frames without either; they have the time of reading
  std::uint64_t capped_reads = 0;          ///< calls that may have left frames for the next

  CanCounters& operator+=(const CanCounters& other);
  bool operator==(const CanCounters&) const = default;
};

/// All counters by name, for reports.
inline constexpr std::array<std::pair<std::string_view, std::uint64_t CanCounters::*>, 17>
    kCanCounters = {{{"frames", &CanCounters::frames},
                     {"dropped", &CanCounters::dropped},
                     {"error_frames", &CanCounters::error_frames},
                     {"bus_off", &CanCounters::bus_off},
                     {"restarted", &CanCounters::restarted},
                     {"controller_warnings", &CanCounters::controller_warnings},
                     {"controller_overflows", &CanCounters::controller_overflows},
                     {"other_errors", &CanCounters::other_errors},
                     {"went_down", &CanCounters::went_down},
                     {"disappeared", &CanCounters::disappeared},
                     {"came_back", &CanCounters::came_back},
                     {"failed_rebinds", &CanCounters::failed_rebinds},
                     {"read_errors", &CanCounters::read_errors},
                     {"malformed", &CanCounters::malformed},
                     {"hardware_stamps", &CanCounters::hardware_stamps},
                     {"missing_stamps", &CanCounters::missing_stamps},
                     {"capped_reads", &CanCounters::capped_reads}}};
static_assert(sizeof(CanCounters) == kCanCounters.size() * sizeof(std::uint64_t),
              "every counter has a name");

inline CanCounters& CanCounters::operator+=(const CanCounters& other) {
  for (const auto& [name, member] : kCanCounters) {
    this->*member += other.*member;
  }
  return *this;
}

}  // namespace topoloc::can
