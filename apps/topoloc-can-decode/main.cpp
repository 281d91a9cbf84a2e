// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/candump.hpp"
#include "topoloc/can/dbc.hpp"

#include "common/run_app.hpp"

#include <cstdint>
#include <iostream>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace {

using namespace topoloc::can;

constexpr auto kExamples = R"(Examples:
  topoloc-can-decode --dbc car.dbc can.log
  topoloc-can-decode --dbc car.dbc --signal WHEELS.FL --signal WHEELS.FR can.log
  topoloc-can-decode --dbc car.dbc --json can.log | head -1
    {"interface":"can0","message":"WHEELS","signals":{"FL":12.5},"time_ns":1533226488434432000})";

struct Options {
  std::string dbc;
  std::string log;
  std::vector<std::string> signals;
  bool json = false;
};

void print_json(const Frame& frame, const Message& message,
                const std::vector<std::pair<const Signal*, double>>& values) {
  nlohmann::json line = {{"time_ns", frame.time_ns},
                         {"interface", frame.interface()},
                         {"message", message.name},
                         {"signals", nlohmann::json::object()}};
  for (const auto& [signal, value] : values) {
    line["signals"][signal->name] = value;  // NaN and infinity become null
  }
  std::cout << line << '\n';
}

void print_text(const Frame& frame, const Message& message,
                const std::vector<std::pair<const Signal*, double>>& values) {
  for (const auto& [signal, value] : values) {
    std::cout << frame.time_ns << ' ' << frame.interface() << ' ' << message.name << '.'
              << signal->name << ' ' << value << (signal->unit.empty() ? "" : " ") << signal->unit
              << '\n';
  }
}

int run(const Options& options) {
  const Dbc dbc = Dbc::load(options.dbc);
  // What to print of each message, in the order of the DBC.
  std::unordered_map<const Message*, std::vector<const Signal*>> wanted;
  for (const std::string& name : options.signals) {
    const SignalRef ref = dbc.signal(name);
    wanted[ref.message].push_back(ref.signal);
  }
  std::unordered_map<std::uint64_t, const Message*> by_id;
  for (const Message& message : dbc.messages()) {
    by_id[std::uint64_t{message.id} << 1 | (message.extended ? 1U : 0U)] = &message;
    for (const Signal& signal : message.signals) {
      if (options.signals.empty()) {
        wanted[&message].push_back(&signal);
      }
    }
  }

  std::cout.precision(17);
  CandumpReader reader(options.log);
  std::uint64_t too_short = 0;
  std::uint64_t in_database = 0;
  std::set<std::uint32_t> others;  // ids that the database does not have
  std::vector<std::pair<const Signal*, double>> values;
  for (Frame frame; reader.next(frame);) {
    const auto found = by_id.find(std::uint64_t{frame.id} << 1 | (frame.extended ? 1U : 0U));
    if (frame.kind != FrameKind::kData) {
      continue;
    }
    if (found == by_id.end()) {
      others.insert(frame.id);
      continue;
    }
    ++in_database;
    const Message& message = *found->second;
    values.clear();
    for (const Signal* signal : wanted[&message]) {
      const auto value = decode(signal->coding, frame.payload());
      too_short += value ? 0 : 1;
      if (value && is_present(message, *signal, frame.payload())) {
        values.emplace_back(signal, *value);
      }
    }
    if (!values.empty()) {
      options.json ? print_json(frame, message, values) : print_text(frame, message, values);
    }
  }
  if (reader.malformed_count() > 0) {
    std::cerr << "topoloc-can-decode: " << reader.malformed_count()
              << " malformed lines, first: " << reader.first_error() << '\n';
  }
  if (too_short > 0) {
    std::cerr << "topoloc-can-decode: " << too_short << " values missing in too short frames\n";
  }
  if (in_database == 0) {
    std::cerr << "topoloc-can-decode: none of the " << reader.frame_count() << " frames in "
              << options.log << " is in " << options.dbc << "; ids in the log:" << std::hex
              << std::uppercase;
    for (const std::uint32_t id : others) {
      std::cerr << ' ' << id;
    }
    std::cerr << '\n';
    return 1;
  }
  if (!std::cout.flush()) {
    std::cerr << "topoloc-can-decode: cannot write the output\n";
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints the signals in a candump log, decoded with a DBC, in the DBC's units.",
               "topoloc-can-decode");
  app.footer(kExamples);
  Options options;
  app.add_option("--dbc", options.dbc, "CAN database")->required();
  app.add_option("--signal", options.signals, "MESSAGE.SIGNAL to print (default: all)")
      ->take_all()
      ->expected(1);
  app.add_flag("--json", options.json, "one JSON object per frame");
  app.add_option("log", options.log, "log written by candump -L")->required();
  app.set_version_flag("--version", TOPOLOC_VERSION);
  return topoloc::apps::run_app(app, "topoloc-can-decode", argc, argv,
                                [&] { return run(options); });
}
