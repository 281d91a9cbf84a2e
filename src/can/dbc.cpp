// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/dbc.hpp"

#include "can/dbc_parser.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>
#include <stdexcept>

namespace topoloc::can {
namespace {

/// Levenshtein distance, case-insensitive: for "did you mean".
std::size_t edit_distance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; };
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, replaced});
    }
  }
  return row.back();
}

/// " Close names: A, B, C." or "", nearest first.
std::string close_names(std::string_view wanted, const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 3;
  std::vector<std::pair<std::size_t, std::string>> ranked;
  ranked.reserve(names.size());
  for (const std::string& candidate : names) {
    ranked.emplace_back(edit_distance(wanted, candidate), candidate);
  }
  std::sort(ranked.begin(), ranked.end());
  std::string list;
  for (std::size_t i = 0; i < std::min(kMost, ranked.size()); ++i) {
    if (ranked[i].first <= std::max<std::size_t>(wanted.size() / 3, 2)) {
      list += (list.empty() ? "" : ", ") + ranked[i].second;
    }
  }
  return list.empty() ? list : "; close names: " + list;
}

}  // namespace

const Signal* Message::find(std::string_view signal_name) const {
  const auto found = std::find_if(signals.begin(), signals.end(),
                                  [&](const Signal& s) { return s.name == signal_name; });
  return found == signals.end() ? nullptr : &*found;
}

bool is_present(const Message& message, const Signal& signal,
                std::span<const std::uint8_t> payload) {
  const Signal* child = &signal;
  while (child->multiplexor != kNoMultiplexor) {
    const Signal& selector = message.signals[static_cast<std::size_t>(child->multiplexor)];
    const auto raw = extract_raw(selector.coding, payload);
    const auto selects = [&](const MultiplexRange& range) {
      return raw && *raw >= range.first && *raw <= range.last;
    };
    if (std::none_of(child->selected_by.begin(), child->selected_by.end(), selects)) {
      return false;
    }
    child = &selector;
  }
  return true;
}

Dbc::Dbc(std::string name, std::vector<Message> messages)
    : name_(std::move(name)), messages_(std::move(messages)) {}

Dbc Dbc::load(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot open DBC file");
  }
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) {
    throw std::runtime_error(file.string() + ": read error");
  }
  return parse(text, file.string());
}

Dbc Dbc::parse(std::string_view text, const std::string& name) {
  return {name, DbcParser(text, name).parse()};
}

const Message* Dbc::find(std::uint32_t id, bool extended) const {
  const auto found = std::find_if(messages_.begin(), messages_.end(), [&](const Message& m) {
    return m.id == id && m.extended == extended;
  });
  return found == messages_.end() ? nullptr : &*found;
}

SignalRef Dbc::signal(std::string_view message_dot_signal) const {
  const auto fail = [&](const std::string& what) { throw std::runtime_error(name_ + ": " + what); };
  const std::string full(message_dot_signal);
  const std::size_t dot = message_dot_signal.find('.');
  if (dot == std::string_view::npos) {
    fail("signal '" + full + "': expected MESSAGE.SIGNAL");
  }
  const std::string_view message_name = message_dot_signal.substr(0, dot);
  const std::string_view signal_name = message_dot_signal.substr(dot + 1);
  const auto message = std::find_if(messages_.begin(), messages_.end(),
                                    [&](const Message& m) { return m.name == message_name; });
  if (message == messages_.end()) {
    std::vector<std::string> names;
    std::transform(messages_.begin(), messages_.end(), std::back_inserter(names),
                   [](const Message& m) { return m.name; });
    fail("signal '" + full + "': no message '" + std::string(message_name) + "'" +
         close_names(message_name, names));
  }
  const Signal* signal = message->find(signal_name);
  if (signal == nullptr) {
    std::vector<std::string> names;
    std::transform(message->signals.begin(), message->signals.end(), std::back_inserter(names),
                   [](const Signal& s) { return s.name; });
    fail("signal '" + full + "': message '" + message->name + "' has no signal '" +
         std::string(signal_name) + "'" + close_names(signal_name, names));
  }
  if (signal->coding.length_bits > 64) {
    fail("signal '" + full + "': " + std::to_string(signal->coding.length_bits) +
         " bits long, at most 64 can be decoded");
  }
  return {&*message, signal};
}

}  // namespace topoloc::can
