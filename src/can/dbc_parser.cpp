// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/dbc_parser.hpp"

#include "topoloc/can/frame.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace topoloc::can {
namespace {

constexpr std::uint32_t kExtendedFlag = 0x8000'0000U;

/// Statements without meaning here; each ends with a semicolon.
constexpr auto kSkipped = std::to_array<std::string_view>({
    "BA_",        "BA_DEF_",    "BA_DEF_DEF_", "BA_DEF_DEF_REL_",  "BA_DEF_REL_", "BA_DEF_SGTYPE_",
    "BA_REL_",    "BA_SGTYPE_", "BO_TX_BU_",   "BU_BO_REL_",       "BU_EV_REL_",  "BU_SG_REL_",
    "CAT_",       "CAT_DEF_",   "CM_",         "ENVVAR_DATA_",     "EV_",         "EV_DATA_",
    "FILTER",     "SGTYPE_",    "SGTYPE_VAL_", "SIGTYPE_VALTYPE_", "SIG_GROUP_",  "SIG_TYPE_REF_",
    "VAL_TABLE_",
});

bool contains(const auto& list, std::string_view word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

bool starts_statement(std::string_view word) {
  constexpr auto kRead = std::to_array<std::string_view>(
      {"BO_", "SG_", "VAL_", "SIG_VALTYPE_", "SG_MUL_VAL_", "VERSION", "NS_", "BS_", "BU_"});
  return contains(kRead, word) || contains(kSkipped, word);
}

}  // namespace

std::vector<Message> DbcParser::parse() {
  if (text_.starts_with("\xEF\xBB\xBF")) {
    position_ = 3;  // byte order mark of some Windows editors
  }
  for (skip_space(); !at_end(); skip_space()) {
    if (accept(';')) {
      continue;
    }
    const std::string_view keyword = word();
    if (keyword == "BO_") {
      parse_message();
    } else if (keyword == "SG_") {
      parse_signal();
    } else if (keyword == "SIG_VALTYPE_") {
      parse_value_type();
    } else if (keyword == "SG_MUL_VAL_") {
      parse_multiplex_values();
    } else if (keyword == "VAL_") {
      parse_value_names();
    } else if (keyword == "NS_") {
      skip_keyword_list();
    } else if (keyword == "BU_") {
      skip_node_list();
    } else if (keyword == "BS_") {
      skip_line();
    } else if (keyword == "VERSION") {
      expect_string("the version");
    } else if (contains(kSkipped, keyword)) {
      skip_statement(keyword);
    } else {
      fail(keyword.empty() ? "expected a DBC statement, found '" + std::string(1, peek()) + "'"
                           : "unknown DBC statement '" + std::string(keyword) + "'");
    }
  }
  if (messages_.empty()) {
    fail("no message (BO_) in this file: is it a DBC?");
  }
  for (std::size_t i = 0; i < messages_.size(); ++i) {
    resolve_multiplexing(i);
  }
  return std::move(messages_);
}

// BO_ 2364540158 EEC1: 8 Sender
void DbcParser::parse_message() {
  Message message;
  const auto id = static_cast<std::uint32_t>(expect_unsigned("a message id", 0xFFFF'FFFFU));
  message.extended = (id & kExtendedFlag) != 0;
  message.id = id & ~kExtendedFlag;
  if (!message.extended && id > kMaxStandardId) {
    fail("message id " + std::to_string(id) +
         " does not fit 11 bits, and bit 31, which marks extended ids, is not set");
  }
  message.name = expect_word("a message name");
  expect(':', "behind the message name");
  message.length_bytes = static_cast<std::uint16_t>(expect_unsigned("a message length", 0xFFFF));
  skip_line();  // the sender
  if (!by_id_.emplace(id, messages_.size()).second) {
    fail("message '" + message.name + "' has the id of '" + messages_[by_id_[id]].name + "'");
  }
  messages_.push_back(std::move(message));
  multiplexing_.emplace_back();
}

// SG_ NAME m3 : 7|16@0- (0.01,-5) [-100|100] "km/h" Receiver,Receiver
void DbcParser::parse_signal() {
  if (messages_.empty()) {
    fail("signal before the first message");
  }
  Signal signal;
  Multiplexing multiplexing{.line = line_};
  signal.name = expect_word("a signal name");
  if (const std::string_view token = word(); !token.empty()) {
    parse_multiplexing(token, signal, multiplexing);
  }
  expect(':', "behind the signal name");
  SignalCoding& coding = signal.coding;
  coding.start_bit = static_cast<std::uint16_t>(expect_unsigned("a start bit", 0xFFFF));
  expect('|', "behind the start bit");
  coding.length_bits = static_cast<std::uint16_t>(expect_unsigned("a length in bits", 0xFFFF));
  if (coding.length_bits == 0) {
    fail("signal '" + signal.name + "' has no bits");
  }
  expect('@', "behind the length");
  coding.byte_order =
      expect_unsigned("a byte order (0 or 1)", 1) == 0 ? ByteOrder::kMotorola : ByteOrder::kIntel;
  if (accept('-')) {
    coding.value_type = ValueType::kSigned;
  } else {
    expect('+', "or '-' behind the byte order");
  }
  expect('(', "before the scale");
  coding.scale = expect_number("a scale");
  expect(',', "between scale and offset");
  coding.offset = expect_number("an offset");
  expect(')', "behind the offset");
  expect('[', "before the minimum");
  signal.minimum = expect_number("a minimum");
  expect('|', "between minimum and maximum");
  signal.maximum = expect_number("a maximum");
  expect(']', "behind the maximum");
  signal.unit = expect_string("the unit");
  skip_line();  // the receivers
  messages_.back().signals.push_back(std::move(signal));
  multiplexing_.back().push_back(multiplexing);
}

// "M", "m3" or "m3M".
void DbcParser::parse_multiplexing(std::string_view token, Signal& signal,
                                   Multiplexing& multiplexing) {
  const auto refuse = [&, shown = std::string(token)] {
    fail("expected ':' or a multiplexing mark (M, m3, m3M), found '" + shown + "'");
  };
  if (token.starts_with('m')) {
    token.remove_prefix(1);
    const auto [end, error] =
        std::from_chars(token.data(), token.data() + token.size(), multiplexing.value);
    if (error != std::errc{}) {
      refuse();
    }
    multiplexing.selected = true;
    token.remove_prefix(static_cast<std::size_t>(end - token.data()));
  }
  signal.is_multiplexor = token == "M";
  if (!token.empty() && !signal.is_multiplexor) {
    refuse();
  }
}

Signal* DbcParser::expect_signal(std::size_t& message_index) {
  const auto id = static_cast<std::uint32_t>(expect_unsigned("a message id", 0xFFFF'FFFFU));
  const std::string_view signal_name = expect_word("a signal name");
  const auto found = by_id_.find(id);
  if (found == by_id_.end()) {
    return nullptr;
  }
  message_index = found->second;
  auto& signals = messages_[message_index].signals;
  const auto signal = std::find_if(signals.begin(), signals.end(),
                                   [&](const Signal& s) { return s.name == signal_name; });
  return signal == signals.end() ? nullptr : &*signal;
}

// SIG_VALTYPE_ 100 NAME : 1;    (1: float, 2: double)
void DbcParser::parse_value_type() {
  std::size_t message_index = 0;
  Signal* signal = expect_signal(message_index);
  accept(':');
  const std::uint64_t type = expect_unsigned("a value type", 3);
  if (signal != nullptr && (type == 1 || type == 2)) {
    const unsigned bits = type == 1 ? 32 : 64;
    if (signal->coding.length_bits != bits) {
      fail("signal '" + signal->name + "' is declared a float of " + std::to_string(bits) +
           " bits but has " + std::to_string(signal->coding.length_bits));
    }
    signal->coding.value_type = type == 1 ? ValueType::kFloat32 : ValueType::kFloat64;
  }
  skip_statement("SIG_VALTYPE_");
}

// SG_MUL_VAL_ 100 NAME MULTIPLEXOR 0-3, 7-7;
void DbcParser::parse_multiplex_values() {
  std::size_t message_index = 0;
  Signal* signal = expect_signal(message_index);
  const std::string_view selector_name = expect_word("a multiplexor name");
  std::vector<MultiplexRange> ranges;
  do {
    skip_space();
    MultiplexRange range;
    range.first = expect_unsigned("a multiplexor value", ~std::uint64_t{0});
    expect('-', "between the ends of a range");
    range.last = expect_unsigned("a multiplexor value", ~std::uint64_t{0});
    ranges.push_back(range);
    skip_space();
  } while (accept(','));
  expect(';', "behind the multiplexor values");
  if (signal == nullptr) {
    return;
  }
  const Message& message = messages_[message_index];
  const Signal* selector = message.find(selector_name);
  if (selector == nullptr) {
    fail("message '" + message.name + "' has no multiplexor '" + std::string(selector_name) + "'");
  }
  signal->multiplexor = static_cast<int>(selector - message.signals.data());
  signal->selected_by = std::move(ranges);
}

// VAL_ 100 NAME 0 "off" 1 "on" ;     (also VAL_ ENVIRONMENT_VARIABLE ...: skipped)
void DbcParser::parse_value_names() {
  skip_blanks();
  if (peek() < '0' || peek() > '9') {
    skip_statement("VAL_");
    return;
  }
  std::size_t message_index = 0;
  Signal* signal = expect_signal(message_index);
  for (skip_space(); !accept(';'); skip_space()) {
    const double value = expect_number("a value");
    if (std::abs(value) > 0x1p62 || value != std::round(value)) {
      fail("value names are for whole numbers");
    }
    skip_space();
    std::string value_name = expect_string("a value name");
    if (signal != nullptr) {
      signal->value_names.emplace_back(static_cast<std::int64_t>(value), std::move(value_name));
    }
  }
}

// "NS_ :" and one keyword a line. They look like statements, so they must not be read as such.
void DbcParser::skip_keyword_list() {
  accept(':');
  for (skip_space(); !at_end(); skip_space()) {
    const std::size_t position = position_;
    const bool keyword = !word().empty();
    skip_blanks();
    if (!keyword || (!at_end() && peek() != '\n')) {
      position_ = position;
      return;
    }
  }
}

// "BU_: NODE NODE", also over several lines.
void DbcParser::skip_node_list() {
  accept(':');
  for (skip_space(); !at_end(); skip_space()) {
    const std::size_t position = position_;
    const std::string_view node = word();
    if (node.empty() || starts_statement(node)) {
      position_ = position;
      return;
    }
    accept(',');
  }
}

void DbcParser::resolve_multiplexing(std::size_t message_index) {
  Message& message = messages_[message_index];
  const auto& declared = multiplexing_[message_index];
  int root = kNoMultiplexor;
  int roots = 0;
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    if (message.signals[i].is_multiplexor && !declared[i].selected) {
      root = static_cast<int>(i);
      ++roots;
    }
  }
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    Signal& signal = message.signals[i];
    if (declared[i].selected && signal.multiplexor == kNoMultiplexor) {
      if (roots != 1) {
        fail_at(declared[i].line, "signal '" + signal.name + "' is multiplexed, but message '" +
                                      message.name + "' has " + std::to_string(roots) +
                                      " multiplexors (M) and no SG_MUL_VAL_ names one");
      }
      signal.multiplexor = root;
      signal.selected_by = {{declared[i].value, declared[i].value}};
    }
  }
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    std::size_t steps = 0;
    for (int at = static_cast<int>(i); at != kNoMultiplexor;
         at = message.signals[static_cast<std::size_t>(at)].multiplexor) {
      if (++steps > message.signals.size()) {
        fail_at(declared[i].line,
                "the multiplexors of signal '" + message.signals[i].name + "' form a circle");
      }
    }
  }
}

}  // namespace topoloc::can
