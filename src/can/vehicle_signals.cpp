// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/vehicle_signals.hpp"

#include "can/vehicle_signals_table.hpp"

#include <algorithm>
#include <numeric>
#include <set>

namespace topoloc::can {

std::string_view name(SignalReject reason) {
  constexpr std::array<std::string_view, kSignalRejectCount> kNames = {
      "not a data frame",     "too short",     "multiplex mismatch",
      "out of limits",        "not finite",    "non-monotonic time",
      "leap in time",         "unpaired",      "wrong checksum",
      "counter out of range", "counter frozen"};
  return kNames[static_cast<std::size_t>(reason)];
}

VehicleSignals::VehicleSignals(const VehicleSignalsConfig& config)
    : table_(std::make_unique<Table>(config)) {}
VehicleSignals::~VehicleSignals() = default;
VehicleSignals::VehicleSignals(VehicleSignals&&) noexcept = default;
VehicleSignals& VehicleSignals::operator=(VehicleSignals&&) noexcept = default;

VehicleSamples VehicleSignals::feed(const Frame& frame) noexcept {
  VehicleSamples samples;
  Table& table = *table_;
  const FrameId id = {frame.id, frame.extended};
  const auto by_id = [](const SignalPart& part, const FrameId& wanted) { return part.id < wanted; };
  auto part = std::lower_bound(table.parts.begin(), table.parts.end(), id, by_id);
  bool taken = false;
  bool mismatch = false;
  bool checked = false;
  for (; part != table.parts.end() && part->id == id; ++part) {
    if (!part->takes_interface_of(frame)) {
      continue;
    }
    if (frame.kind != FrameKind::kData) {
      table.reject(SignalReject::kNotDataFrame);
      return samples;
    }
    if (!checked) {
      checked = true;
      if (const auto reject = table.check(frame)) {
        table.reject(*reject);
        return samples;
      }
    }
    const auto reject = table.read(*part, frame, samples);
    if (reject == SignalReject::kMultiplexMismatch) {
      mismatch = true;
    } else {
      taken = true;
      if (reject) {
        table.reject(*reject);
      }
    }
  }
  if (mismatch && !taken) {  // else the frame is one of the other parts of its message
    table.reject(SignalReject::kMultiplexMismatch);
  }
  table.counts.other_frames += mismatch || taken ? 0 : 1;
  return samples;
}

std::optional<SignalReject> VehicleSignals::Table::check(const Frame& frame) {
  for (MessageCheck& message : checks) {
    if (!message.concerns(frame)) {
      continue;
    }
    switch (message.check(frame)) {
      case CheckVerdict::kOk:
        break;
      case CheckVerdict::kTooShort:
        return SignalReject::kTooShort;
      case CheckVerdict::kWrongChecksum:
        return SignalReject::kWrongChecksum;
      case CheckVerdict::kCounterOutOfRange:
        return SignalReject::kCounterOutOfRange;
      case CheckVerdict::kCounterFrozen:
        return SignalReject::kCounterFrozen;
    }
  }
  return std::nullopt;
}

std::optional<SignalReject> VehicleSignals::Table::read(const SignalPart& part, const Frame& frame,
                                                        VehicleSamples& samples) {
  if (part.group == SampleGroup::kDirection) {
    SampleValues none{};
    std::uint64_t raw = 0;
    const auto reject = part.read(frame, none, raw);
    if (!reject) {
      ++counts.used;
      reversing = std::find(reverse_raw.begin(), reverse_raw.end(), raw) != reverse_raw.end();
    }
    return reject;
  }
  const bool is_imu = part.group == SampleGroup::kImu;
  SampleAssembler& assembler = is_imu ? imu : wheels;
  SampleValues values = assembler.values();
  std::uint64_t counter = 0;
  if (const auto reject = part.read(frame, values, counter)) {
    return reject;
  }
  const auto result = assembler.add(part.index, frame.time_ns, counter, values);
  reject(SignalReject::kUnpaired, result.unpaired);
  switch (result.time) {
    case TimeLine::Verdict::kGoneBack:
      return SignalReject::kNonMonotonicTime;
    case TimeLine::Verdict::kLeaptAhead:
      return SignalReject::kLeapInTime;
    case TimeLine::Verdict::kAcceptedNewLine:
      ++new_time_lines;
      break;
    case TimeLine::Verdict::kAccepted:
      break;
  }
  if (!result.complete) {
    return std::nullopt;
  }
  const std::int64_t time_ns = is_imu ? imu.time_ns(imu_time_part) : frame.time_ns;
  std::optional<std::int64_t>& last_ns = is_imu ? last_imu_ns : last_speed_ns;
  if (time_ns == last_ns) {
    reject(SignalReject::kNonMonotonicTime, assembler.part_count() - 1);
    return SignalReject::kNonMonotonicTime;
  }
  last_ns = time_ns;
  counts.used += assembler.part_count();
  if (is_imu) {
    ++counts.imu_samples;
    samples.imu = estimation::ImuSample{.time_ns = time_ns,
                                        .specific_force_mps2 = {values[0], values[1], values[2]},
                                        .angular_rate_radps = {values[3], values[4], values[5]}};
    return std::nullopt;
  }
  ++counts.speed_samples;
  const auto wheels_used = static_cast<std::ptrdiff_t>(wheel_count);
  const double sum = std::accumulate(values.begin(), values.begin() + wheels_used, 0.0);
  const double speed_mps = sum / static_cast<double>(wheel_count);
  samples.speed =
      estimation::SpeedSample{.time_ns = time_ns, .speed_mps = reversing ? -speed_mps : speed_mps};
  return std::nullopt;
}

std::vector<UsedMessage> VehicleSignals::used_messages() const {
  std::set<UsedMessage> used;
  for (const SignalPart& part : table_->parts) {
    used.insert({.interface = part.interface_name.data(), .id = part.id});
  }
  return {used.begin(), used.end()};
}

std::uint64_t VehicleSignals::rejected(SignalReject reason) const {
  return table_->rejected[static_cast<std::size_t>(reason)];
}

SignalCounts VehicleSignals::counts() const {
  SignalCounts counts = table_->counts;
  counts.waiting = table_->imu.waiting() + table_->wheels.waiting();
  return counts;
}

std::uint64_t VehicleSignals::lost_messages() const {
  std::uint64_t lost = 0;
  for (const MessageCheck& check : table_->checks) {
    lost += check.lost();
  }
  return lost;
}

std::uint64_t VehicleSignals::new_time_lines() const { return table_->new_time_lines; }

std::uint64_t VehicleSignals::rejected_total() const {
  return std::accumulate(table_->rejected.begin(), table_->rejected.end(), std::uint64_t{0});
}

}  // namespace topoloc::can
