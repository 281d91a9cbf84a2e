// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/signal_part.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::can {

std::vector<MultiplexCondition> multiplex_conditions(const SignalRef& ref) {
  std::vector<MultiplexCondition> conditions;
  for (const Signal* child = ref.signal; child->multiplexor != kNoMultiplexor;) {
    const Signal& selector = ref.message->signals[static_cast<std::size_t>(child->multiplexor)];
    conditions.push_back({selector.coding, child->selected_by});
    child = &selector;
  }
  return conditions;
}

std::optional<SignalReject> SignalPart::read(const Frame& frame, SampleValues& values,
                                             std::uint64_t& raw) const {
  const auto payload = frame.payload();
  for (const MultiplexCondition& condition : conditions) {
    const auto selector = extract_raw(condition.selector, payload);
    if (!selector) {
      return SignalReject::kTooShort;
    }
    const bool selected = std::any_of(
        condition.selected_by.begin(), condition.selected_by.end(),
        [&](const MultiplexRange& r) { return *selector >= r.first && *selector <= r.last; });
    if (!selected) {
      return SignalReject::kMultiplexMismatch;
    }
  }
  SampleValues read_values = values;
  for (const ValueReader& reader : readers) {
    const auto physical = decode(reader.coding, payload);
    if (!physical) {
      return SignalReject::kTooShort;
    }
    if (!std::isfinite(*physical)) {
      return SignalReject::kNotFinite;
    }
    // Limits are printed in decimal and need not fall on a raw value: half a step is rounding.
    const double margin = 0.5 * std::abs(reader.coding.scale);
    if (reader.check_limits &&
        (*physical < reader.minimum - margin || *physical > reader.maximum + margin)) {
      return SignalReject::kOutOfLimits;
    }
    read_values[reader.slot] = *physical * reader.to_si;
  }
  if (raw_signal) {
    const auto bits = extract_raw(*raw_signal, payload);
    if (!bits) {
      return SignalReject::kTooShort;
    }
    raw = *bits;
  }
  values = read_values;
  return std::nullopt;
}

}  // namespace topoloc::can
