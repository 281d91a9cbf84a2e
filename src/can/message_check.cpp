// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/message_check.hpp"

#include <stdexcept>

namespace topoloc::can {
namespace {

std::uint8_t crc8_step(std::uint8_t crc, std::uint8_t byte) {
  crc = static_cast<std::uint8_t>(crc ^ byte);
  for (int bit = 0; bit < 8; ++bit) {
    const unsigned shifted = static_cast<unsigned>(crc) << 1U;
    crc = static_cast<std::uint8_t>((crc & 0x80U) != 0 ? shifted ^ 0x1DU : shifted);
  }
  return crc;
}

std::uint8_t step(Checksum algorithm, std::uint8_t sum, std::uint8_t byte) {
  switch (algorithm) {
    case Checksum::kXor8:
      return sum ^ byte;
    case Checksum::kSum8:
      return static_cast<std::uint8_t>(sum + byte);
    case Checksum::kCrc8J1850:
    case Checksum::kE2eProfile1:
      return crc8_step(sum, byte);
  }
  return sum;
}

[[noreturn]] void fail(const MessageCheckConfig& config, const std::string& what) {
  throw std::runtime_error((config.place.empty() ? "" : config.place + ": ") + "message '" +
                           config.message + "': " + what);
}

const Signal& find_signal(const MessageCheckConfig& config, const Message& message,
                          const std::string& name) {
  const Signal* const signal = message.find(name);
  if (signal == nullptr) {
    fail(config, "has no signal '" + name + "'");
  }
  if (signal->multiplexor != kNoMultiplexor || signal->coding.length_bits > 64) {
    fail(config, "signal '" + name + "' is not in all of its frames, or too long");
  }
  return *signal;
}

}  // namespace

std::uint8_t checksum(Checksum algorithm, std::optional<std::uint16_t> data_id,
                      std::span<const std::uint8_t> payload, std::size_t at) {
  const std::uint8_t ones = algorithm == Checksum::kCrc8J1850 ? 0xFF : 0;  // first and last
  std::uint8_t sum = ones;
  if (data_id) {
    sum = step(algorithm, sum, static_cast<std::uint8_t>(*data_id & 0xFFU));
    sum = step(algorithm, sum, static_cast<std::uint8_t>(*data_id >> 8U));
  }
  for (std::size_t i = 0; i < payload.size(); ++i) {
    sum = i == at ? sum : step(algorithm, sum, payload[i]);
  }
  return sum ^ ones;
}

MessageCheck::MessageCheck(const MessageCheckConfig& config, const Message& message)
    : id_{message.id, message.extended},
      interface_(config.interface),
      algorithm_(config.algorithm),
      data_id_(config.data_id) {
  if (config.counter.empty() && config.checksum.empty()) {
    fail(config, "neither counter nor checksum is given");
  }
  const bool e2e = !config.checksum.empty() && config.algorithm == Checksum::kE2eProfile1;
  if (e2e && !config.data_id) {
    fail(config, "e2e-profile1 needs a data_id");
  }
  if (!config.counter.empty()) {
    counter_ = find_signal(config, message, config.counter).coding;
    const std::uint64_t all_ones = ~std::uint64_t{0} >> (64U - counter_->length_bits);
    counter_max_ = config.counter_max.value_or(e2e && all_ones == 15 ? 14 : all_ones);
    if (counter_max_ == 0 || counter_max_ > all_ones || counter_->length_bits > 32) {
      fail(config, "counter '" + config.counter + "' of " + std::to_string(counter_->length_bits) +
                       " bits cannot count to " + std::to_string(counter_max_));
    }
  }
  if (!config.checksum.empty()) {
    const SignalCoding& coding = find_signal(config, message, config.checksum).coding;
    const unsigned first_bit = coding.byte_order == ByteOrder::kIntel ? 0 : 7;
    if (coding.length_bits != 8 || coding.start_bit % 8U != first_bit) {
      fail(config, "checksum '" + config.checksum + "' is not one whole byte");
    }
    checksum_byte_ = coding.start_bit / 8U;
  }
}

bool MessageCheck::concerns(const Frame& frame) const {
  return id_ == FrameId{frame.id, frame.extended} &&
         (interface_.empty() || interface_ == frame.interface());
}

CheckVerdict MessageCheck::check(const Frame& frame) noexcept {
  const auto payload = frame.payload();
  if (checksum_byte_) {
    if (*checksum_byte_ >= payload.size()) {
      return CheckVerdict::kTooShort;
    }
    if (checksum(algorithm_, data_id_, payload, *checksum_byte_) != payload[*checksum_byte_]) {
      return CheckVerdict::kWrongChecksum;
    }
  }
  if (!counter_) {
    return CheckVerdict::kOk;
  }
  const auto counter = extract_raw(*counter_, payload);
  if (!counter) {
    return CheckVerdict::kTooShort;
  }
  if (*counter > counter_max_) {
    return CheckVerdict::kCounterOutOfRange;
  }
  if (last_counter_) {
    const std::uint64_t turn = counter_max_ + 1;
    const std::uint64_t steps = (*counter + turn - *last_counter_) % turn;
    if (steps == 0) {
      return CheckVerdict::kCounterFrozen;
    }
    lost_ += steps - 1;
  }
  last_counter_ = counter;
  return CheckVerdict::kOk;
}

void MessageCheck::seal(Frame& frame) const {
  if (checksum_byte_ && *checksum_byte_ < frame.length) {
    frame.data[*checksum_byte_] = checksum(algorithm_, data_id_, frame.payload(), *checksum_byte_);
  }
}

std::vector<MessageCheck> make_checks(const std::vector<MessageCheckConfig>& configs,
                                      const std::vector<Dbc>& dbcs) {
  std::vector<MessageCheck> checks;
  for (const MessageCheckConfig& config : configs) {
    const Message* found = nullptr;
    for (const Dbc& dbc : dbcs) {
      for (const Message& message : dbc.messages()) {
        if (message.name == config.message) {
          if (found != nullptr) {
            fail(config, "is there more than once in the DBC files");
          }
          found = &message;
        }
      }
    }
    if (found == nullptr) {
      fail(config, "is in no DBC file");
    }
    checks.emplace_back(config, *found);
  }
  return checks;
}

}  // namespace topoloc::can
