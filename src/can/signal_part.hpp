// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"
#include "topoloc/can/vehicle_signals.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::can {

inline constexpr std::size_t kMaxSampleValues = 6;  ///< three accelerations and three rates
using SampleValues = std::array<double, kMaxSampleValues>;

enum class SampleGroup : std::uint8_t { kImu, kWheels, kDirection };

/// Where in a frame one value of a sample is.
struct ValueReader {
  SignalCoding coding;
  bool check_limits = false;
  double minimum = 0.0;  ///< in the DBC's unit
  double maximum = 0.0;
  double to_si = 1.0;
  std::size_t slot = 0;  ///< index in SampleValues
};

/// One step on the way through a message's multiplexors.
struct MultiplexCondition {
  SignalCoding selector;
  std::vector<MultiplexRange> selected_by;
};

/// The part of a sample that comes in one kind of frame: one message, with one choice of
/// multiplexor values, on one interface. Built at start; reading it allocates nothing.
struct SignalPart {
  FrameId id;  ///< of its frames; parts are sorted by it
  std::array<char, kMaxInterfaceNameBytes + 1> interface_name{};  ///< empty: any
  SampleGroup group = SampleGroup::kImu;
  std::size_t index = 0;  ///< of this part within its group
  std::vector<MultiplexCondition> conditions;
  std::optional<SignalCoding> raw_signal;  ///< a counter (IMU) or the direction: not scaled
  std::vector<ValueReader> readers;

  [[nodiscard]] bool takes_interface_of(const Frame& frame) const {
    return interface_name[0] == '\0' || interface_name == frame.interface_name;
  }
  /// Why the values cannot be used; nothing if `values` (the slots of this part) and
  /// `raw` were set. Nothing is set in case of a reject.
  [[nodiscard]] std::optional<SignalReject> read(const Frame& frame, SampleValues& values,
                                                 std::uint64_t& raw) const;
};

/// The conditions under which a signal is in its message's frames.
std::vector<MultiplexCondition> multiplex_conditions(const SignalRef& ref);

}  // namespace topoloc::can
