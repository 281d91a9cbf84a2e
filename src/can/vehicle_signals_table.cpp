// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/vehicle_signals_table.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace topoloc::can {
namespace {

[[noreturn]] void fail(const VehicleSignalsConfig& config, const std::string& what) {
  std::string files;
  for (const auto& file : config.dbcs) {
    files += (files.empty() ? "" : ", ") + file.string();
  }
  throw std::runtime_error(files + ": " + what);
}

double factor_to_si(const VehicleSignalsConfig& config, const std::string& signal_name,
                    const std::string& dbc_unit, const std::string& configured_unit,
                    Quantity quantity) {
  const std::string& unit = configured_unit.empty() ? dbc_unit : configured_unit;
  const auto factor = si_factor(quantity, unit);
  if (!factor) {
    fail(config, "signal '" + signal_name + "': unit '" + unit + "' is not one of " +
                     known_units(quantity) + "; give its unit in the configuration");
  }
  return *factor;
}

ValueReader make_reader(const VehicleSignalsConfig& config, const SignalRef& ref,
                        const std::string& name, const std::string& unit, Quantity quantity,
                        std::size_t slot) {
  const Signal& signal = *ref.signal;
  return {.coding = signal.coding,
          .check_limits = config.check_limits && signal.has_limits(),
          .minimum = signal.minimum,
          .maximum = signal.maximum,
          .to_si = factor_to_si(config, name, signal.unit, unit, quantity),
          .slot = slot};
}

bool same_coding(const SignalCoding& a, const SignalCoding& b) {
  return a.start_bit == b.start_bit && a.length_bits == b.length_bits &&
         a.byte_order == b.byte_order;
}

bool same_conditions(const std::vector<MultiplexCondition>& a,
                     const std::vector<MultiplexCondition>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const MultiplexCondition& x, const MultiplexCondition& y) {
                      return same_coding(x.selector, y.selector) &&
                             std::equal(x.selected_by.begin(), x.selected_by.end(),
                                        y.selected_by.begin(), y.selected_by.end(),
                                        [](const MultiplexRange& r, const MultiplexRange& s) {
                                          return r.first == s.first && r.last == s.last;
                                        });
                    });
}

[[noreturn]] void fail_reverse_value(const VehicleSignalsConfig& config, const std::string& text,
                                     const std::string& what) {
  const std::string message =
      "reverse value '" + text + "' of signal '" + config.direction.signal + "' " + what;
  if (config.direction.reverse_values_place.empty()) {
    fail(config, message);
  }
  throw std::runtime_error(config.direction.reverse_values_place + ": " + message);
}

/// A configured value of the direction signal: a raw number, or the name that VAL_ gives it.
std::int64_t reverse_value(const VehicleSignalsConfig& config, const Signal& signal,
                           const std::string& text) {
  const auto named = std::find_if(signal.value_names.begin(), signal.value_names.end(),
                                  [&](const auto& value) { return value.second == text; });
  if (named != signal.value_names.end()) {
    return named->first;
  }
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc{} && end == text.data() + text.size()) {
    return number;
  }
  std::string known;
  for (const auto& value : signal.value_names) {
    known += (known.empty() ? "" : ", ") + value.second;
  }
  fail_reverse_value(config, text,
                     "is neither a whole number nor one of its value names" +
                         (known.empty() ? "" : " (" + known + ")"));
}

/// The bits that a reverse value is in the payload. Those of a signed signal may be given either
/// way: DBC files list -1 and 255 alike.
std::uint64_t reverse_bits(const VehicleSignalsConfig& config, const Signal& signal,
                           const std::string& text) {
  const std::int64_t value = reverse_value(config, signal, text);
  const unsigned length_bits = signal.coding.length_bits;
  const std::uint64_t mask = ~std::uint64_t{0} >> (64U - length_bits);
  const auto bits = static_cast<std::uint64_t>(value);
  // Of a negative number that fits, all bits from the sign on are set.
  const bool fits = value >= 0 ? bits <= mask
                               : signal.coding.value_type == ValueType::kSigned &&
                                     (bits | mask >> 1U) == ~std::uint64_t{0};
  if (!fits) {
    fail_reverse_value(config, text, "does not fit its " + std::to_string(length_bits) + " bits");
  }
  return bits & mask;
}

}  // namespace

VehicleSignals::Table::Table(const VehicleSignalsConfig& config) {
  DbcSet dbcs(config.dbcs);
  add_imu(dbcs, config);
  add_wheels(dbcs, config);
  if (parts.empty()) {
    fail(config, "neither IMU nor wheel speed signals are configured");
  }
  add_direction(dbcs, config);
  add_checks(dbcs, config);
  // The direction first: it holds for the wheel speeds that come in the same frame.
  std::stable_sort(parts.begin(), parts.end(), [](const SignalPart& a, const SignalPart& b) {
    return a.id != b.id ? a.id < b.id : a.group == SampleGroup::kDirection && b.group != a.group;
  });
}

std::size_t VehicleSignals::Table::part_count(SampleGroup group) const {
  return static_cast<std::size_t>(
      std::count_if(parts.begin(), parts.end(), [&](const auto& p) { return p.group == group; }));
}

SignalPart& VehicleSignals::Table::part_of(const SignalRef& ref, SampleGroup group,
                                           std::string_view interface) {
  SignalPart wanted;
  wanted.id = {ref.message->id, ref.message->extended};
  wanted.group = group;
  wanted.conditions = multiplex_conditions(ref);
  wanted.index = part_count(group);
  std::copy_n(interface.begin(), std::min(interface.size(), kMaxInterfaceNameBytes),
              wanted.interface_name.begin());
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const SignalPart& part) {
    return part.id == wanted.id && part.group == group &&
           same_conditions(part.conditions, wanted.conditions);
  });
  return found != parts.end() ? *found : parts.emplace_back(std::move(wanted));
}

void VehicleSignals::Table::add_imu(DbcSet& dbcs, const VehicleSignalsConfig& config) {
  const auto& wanted = config.imu;
  std::array<std::string, kMaxSampleValues> names;
  std::copy(wanted.acceleration.begin(), wanted.acceleration.end(), names.begin());
  std::copy(wanted.angular_rate.begin(), wanted.angular_rate.end(), names.begin() + 3);
  const auto missing = std::count(names.begin(), names.end(), std::string{});
  if (missing == static_cast<std::ptrdiff_t>(names.size())) {
    return;
  }
  if (missing > 0) {
    fail(config, "the IMU needs three acceleration and three angular rate signals");
  }
  // The frame of the first axis gives the time where the axes come in frames of their own.
  const std::size_t time_slot = wanted.time_source == ImuTimeSource::kAcceleration ? 0 : 3;
  for (std::size_t slot = 0; slot < names.size(); ++slot) {
    const SignalRef ref = dbcs.signal(names[slot], wanted.interface);
    SignalPart& part = part_of(ref, SampleGroup::kImu, wanted.interface);
    const bool rate = slot >= 3;
    part.readers.push_back(make_reader(
        config, ref, names[slot], rate ? wanted.angular_rate_unit : wanted.acceleration_unit,
        rate ? Quantity::kAngularRate : Quantity::kAcceleration, slot));
    if (slot == time_slot) {
      imu_time_part = part.index;
    }
  }
  std::uint16_t counter_bits = 0;
  for (const std::string& name : wanted.counters) {
    const SignalRef ref = dbcs.signal(name, wanted.interface);
    if (counter_bits != 0 && counter_bits != ref.signal->coding.length_bits) {
      fail(config, "counter '" + name + "' is not as long as the others");
    }
    counter_bits = ref.signal->coding.length_bits;
    for (SignalPart& part : parts) {
      if (part.id == FrameId{ref.message->id, ref.message->extended}) {
        part.raw_signal = ref.signal->coding;
      }
    }
  }
  const bool by_counter = !wanted.counters.empty();
  if (by_counter && std::any_of(parts.begin(), parts.end(), [](const SignalPart& part) {
        return part.group == SampleGroup::kImu && !part.raw_signal;
      })) {
    fail(config, "the IMU's counters leave out one of its messages");
  }
  imu.configure(part_count(SampleGroup::kImu), by_counter, wanted.pairing_tolerance_ns);
}

void VehicleSignals::Table::add_wheels(DbcSet& dbcs, const VehicleSignalsConfig& config) {
  const auto& wanted = config.wheels;
  if (wanted.speeds.size() > kMaxWheels) {
    fail(config, "at most " + std::to_string(kMaxWheels) + " wheel speeds, found " +
                     std::to_string(wanted.speeds.size()));
  }
  wheel_count = wanted.speeds.size();
  for (std::size_t slot = 0; slot < wheel_count; ++slot) {
    const SignalRef ref = dbcs.signal(wanted.speeds[slot], wanted.interface);
    SignalPart& part = part_of(ref, SampleGroup::kWheels, wanted.interface);
    part.readers.push_back(
        make_reader(config, ref, wanted.speeds[slot], wanted.unit, Quantity::kSpeed, slot));
  }
  wheels.configure(part_count(SampleGroup::kWheels), false, wanted.pairing_tolerance_ns);
}

void VehicleSignals::Table::add_direction(DbcSet& dbcs, const VehicleSignalsConfig& config) {
  const auto& wanted = config.direction;
  if (wanted.signal.empty()) {
    return;
  }
  if (wanted.reverse_values.empty()) {
    fail(config, "signal '" + wanted.signal + "': no value is configured to mean reverse");
  }
  const SignalRef ref = dbcs.signal(wanted.signal, wanted.interface);
  for (const std::string& text : wanted.reverse_values) {
    reverse_raw.push_back(reverse_bits(config, *ref.signal, text));
  }
  part_of(ref, SampleGroup::kDirection, wanted.interface).raw_signal = ref.signal->coding;
}

void VehicleSignals::Table::add_checks(const DbcSet& dbcs, const VehicleSignalsConfig& config) {
  checks = make_checks(config.checks, dbcs.all());
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const bool used = std::any_of(parts.begin(), parts.end(), [&](const SignalPart& part) {
      const std::string_view interface = part.interface_name.data();
      return part.id == checks[i].id() && (interface.empty() || checks[i].interface().empty() ||
                                           interface == checks[i].interface());
    });
    if (!used) {
      throw std::runtime_error(config.checks[i].place + ": message '" + config.checks[i].message +
                               "' has none of the configured signals");
    }
  }
}

}  // namespace topoloc::can
