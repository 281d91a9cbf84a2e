// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"
#include "topoloc/can/frame.hpp"
#include "topoloc/can/message_check.hpp"
#include "topoloc/estimation/measurements.hpp"

#include <array>
#include <compare>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::can {

/// Which of the IMU's frames gives the sample its time stamp.
enum class ImuTimeSource : std::uint8_t { kAngularRate, kAcceleration };

/// Where IMU, wheel speeds and direction of travel are on the buses. Signals are "MESSAGE.SIGNAL"
/// of one of the DBC files. Empty interface: any. Empty unit: the DBC's unit, which must then be a
/// known one.
struct VehicleSignalsConfig {
  /// A signal named here must be in one file only. Messages of different files may share an id
  /// where they come on different interfaces.
  std::vector<std::filesystem::path> dbcs;

  struct Imu {
    std::array<std::string, 3> acceleration;  ///< x, y, z of the IMU frame; all empty: no IMU
    std::array<std::string, 3> angular_rate;  ///< x, y, z
    std::string acceleration_unit;
    std::string angular_rate_unit;
    /// Counter signals that pair frames, one for each message that holds IMU signals, all of the
    /// same length. Empty: frames are paired by time.
    std::vector<std::string> counters;
    /// Largest time between frames of one sample. Below half the sample period the first partner
    /// within it is also the nearest.
    std::int64_t pairing_tolerance_ns = 2'000'000;
    ImuTimeSource time_source = ImuTimeSource::kAngularRate;
    std::string interface;
  } imu;

  struct Wheels {
    /// Their mean is the speed, stamped when the last of them arrives; at most kMaxWheels.
    std::vector<std::string> speeds;
    std::string unit;
    std::int64_t pairing_tolerance_ns = 10'000'000;  ///< where they are spread over frames
    std::string interface;
  } wheels;

  struct Direction {
    std::string signal;  ///< gear or direction of travel; empty: speeds are signed or never reverse
    std::vector<std::string> reverse_values;  ///< raw numbers or VAL_ names that mean reverse
    /// Where complaints about them shall point to; empty: to the DBC files.
    std::string reverse_values_place;
    std::string interface;
  } direction;

  /// Counters and checksums of messages with signals above.
  std::vector<MessageCheckConfig> checks;

  /// Reject values outside the DBC's [min|max]. Some published files state wrong limits.
  bool check_limits = true;
};

inline constexpr std::size_t kMaxWheels = 4;

/// Why a frame, or what it carried, was not used.
enum class SignalReject : std::uint8_t {
  kNotDataFrame,       ///< remote or error frame with a configured id
  kTooShort,           ///< payload ends before the signal does
  kMultiplexMismatch,  ///< none of the configured signals is in this frame of its message
  kOutOfLimits,        ///< outside the DBC's [min|max]
  kNotFinite,          ///< float signal that is NaN or infinite
  kNonMonotonicTime,   ///< older than the sensor's previous frame, or same time as its last sample
  kLeapInTime,         ///< more than 5 s after the sensor's previous frame, and not yet confirmed
  kUnpaired,           ///< partner frame lost, counter differs or too far apart in time
  kWrongChecksum,
  kCounterOutOfRange,  ///< a counter beyond its largest value
  kCounterFrozen,      ///< a counter as in the frame before
};
inline constexpr std::size_t kSignalRejectCount = 11;
std::string_view name(SignalReject reason);

/// What one frame completed.
struct VehicleSamples {
  std::optional<estimation::ImuSample> imu;
  std::optional<estimation::SpeedSample> speed;
};

/// Where frames and samples went. A frame counts once, or once for each of the samples it is part
/// of; then frames = other_frames + used + all that is rejected + waiting.
struct SignalCounts {
  std::uint64_t other_frames = 0;   ///< of other ids or interfaces
  std::uint64_t used = 0;           ///< became part of a sample, or told the direction
  std::uint64_t waiting = 0;        ///< now, for the partners of their sample
  std::uint64_t imu_samples = 0;    ///< given out
  std::uint64_t speed_samples = 0;  ///< given out
};

/// Frames that signals are read from.
struct UsedMessage {
  std::string interface;  ///< as configured; empty: any
  FrameId id;
  // clang-tidy 14 takes it for a comparison with zero. NOLINTNEXTLINE(modernize-use-nullptr)
  auto operator<=>(const UsedMessage&) const = default;
};

/// Turns CAN frames into IMU and speed samples. The stamps of a sensor's samples increase, but for
/// where its clock was set: frames whose stamps go back or leap ahead are rejected until as many in
/// a row as make five samples agree on the new time; from then on that is the sensor's time.
class VehicleSignals {
 public:
  /// Loads the DBC files. Throws std::runtime_error, naming file and signal, on a signal or unit
  /// that is not known, on half-configured sensors and on a configuration without any sensor.
  explicit VehicleSignals(const VehicleSignalsConfig& config);
  ~VehicleSignals();
  VehicleSignals(VehicleSignals&&) noexcept;
  VehicleSignals& operator=(VehicleSignals&&) noexcept;

  /// Frames in the order of their arrival. Never allocates, never throws. Frames of other ids or
  /// interfaces cost a binary search and are no rejects. Until the first direction frame the
  /// vehicle is taken to drive forward.
  VehicleSamples feed(const Frame& frame) noexcept;

  /// All frames that feed() looks at, each once, sorted: what a bus filter must let through.
  [[nodiscard]] std::vector<UsedMessage> used_messages() const;

  [[nodiscard]] std::uint64_t rejected(SignalReject reason) const;
  [[nodiscard]] std::uint64_t rejected_total() const;
  [[nodiscard]] SignalCounts counts() const;
  /// Messages that the counters of `checks` show to be missing.
  [[nodiscard]] std::uint64_t lost_messages() const;
  /// How often a sensor's clock was set.
  [[nodiscard]] std::uint64_t new_time_lines() const;

 private:
  struct Table;
  std::unique_ptr<Table> table_;
};

}  // namespace topoloc::can
