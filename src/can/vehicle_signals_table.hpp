// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/units.hpp"
#include "topoloc/can/vehicle_signals.hpp"

#include "can/dbc_set.hpp"
#include "can/sample_assembler.hpp"
#include "can/signal_part.hpp"

#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace topoloc::can {

/// All that feed() needs, flat and complete before the first frame.
struct VehicleSignals::Table {
  /// Looks everything up in the DBC files; throws as the constructor of VehicleSignals says.
  explicit Table(const VehicleSignalsConfig& config);

  std::vector<SignalPart> parts;  ///< sorted by id
  std::vector<MessageCheck> checks;

  SampleAssembler imu;
  std::size_t imu_time_part = 0;
  std::optional<std::int64_t> last_imu_ns;

  SampleAssembler wheels;
  std::size_t wheel_count = 0;
  std::optional<std::int64_t> last_speed_ns;

  std::vector<std::uint64_t> reverse_raw;  ///< bits of the direction signal that mean reverse
  bool reversing = false;

  std::uint64_t new_time_lines = 0;
  SignalCounts counts;  ///< but for those that wait
  std::array<std::uint64_t, kSignalRejectCount> rejected{};
  void reject(SignalReject reason, std::uint64_t count = 1) {
    rejected[static_cast<std::size_t>(reason)] += count;
  }
  /// Counter and checksum of a frame, where configured.
  std::optional<SignalReject> check(const Frame& frame);
  /// Reads one part of a sample; `samples` gets what it completes.
  std::optional<SignalReject> read(const SignalPart& part, const Frame& frame,
                                   VehicleSamples& samples);

 private:
  void add_imu(DbcSet& dbcs, const VehicleSignalsConfig& config);
  void add_wheels(DbcSet& dbcs, const VehicleSignalsConfig& config);
  void add_direction(DbcSet& dbcs, const VehicleSignalsConfig& config);
  void add_checks(const DbcSet& dbcs, const VehicleSignalsConfig& config);
  SignalPart& part_of(const SignalRef& ref, SampleGroup group, std::string_view interface);
  [[nodiscard]] std::size_t part_count(SampleGroup group) const;
};

}  // namespace topoloc::can
