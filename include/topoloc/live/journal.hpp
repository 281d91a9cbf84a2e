// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/tick.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

/// The flight recorder: what every tick took in, in LCM event logs (lcmtypes/topoloc_tick_t.lcm).
namespace topoloc::live {

/// Writes a bounded journal: journal_000001.lcm and so on in a folder, each an eighth of the whole;
/// the oldest is removed when there would be more. Not for the estimator thread: it writes files.
class JournalWriter {
 public:
  struct Origin {
    std::string version;       ///< of the program
    std::string vehicle_yaml;  ///< text of the configuration
    bool with_map = true;      ///< or dead reckoning
  };

  /// Makes the folder if needed. The journal of the run before moves into its folder "previous"
  /// (replacing what was there): it may be that of a crash. Throws std::runtime_error that names
  /// the folder.
  JournalWriter(std::filesystem::path folder, std::size_t max_bytes, Origin origin);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// A match set has to be there before the tick that names it. Throw std::runtime_error where the
  /// disk is full or gone.
  void add(const NumberedMatchSet& set);
  /// `after`: where the vehicle was after the tick, if the filter knew. Each file begins with it.
  void add(const TickInput& tick, const std::optional<estimation::InitialPose>& after = {});
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// How a file of a journal begins.
struct JournalFileStart {
  bool from_start = false;  ///< of the process: nothing was before
  bool after_gap = false;   ///< the file before is gone, could not be read or ends early
  /// Where the vehicle was then, if the filter knew.
  std::optional<estimation::InitialPose> pose;
};

/// What a journal turned out to hold.
struct JournalSummary {
  std::uint64_t ticks = 0;
  std::uint64_t lost_ticks = 0;       ///< the recorder was too slow for them
  std::uint64_t lost_match_sets = 0;  ///< named by a tick, not found
  std::uint64_t unreadable = 0;       ///< messages, damaged places, files that are none
  std::uint64_t missing_files = 0;    ///< between the first and the last
  bool other_version = false;         ///< a message is of another version's type, and not read
  bool from_start = false;            ///< the first tick is that of the process
  std::string vehicle_yaml;           ///< text of the configuration it was recorded with
  bool with_map = true;               ///< whether the run had one

  /// All is there: an estimator of the same configuration gives what the live one gave.
  [[nodiscard]] bool is_whole() const {
    return from_start && lost_ticks + lost_match_sets + unreadable + missing_files == 0;
  }
};

/// Takes what is in a journal, in its order.
struct JournalSink {
  std::function<void(const JournalFileStart&)> file;
  /// With the match set that the tick names, or null.
  std::function<void(const TickInput&, const estimation::MapMatchSet*)> tick;
};

/// The files of a journal in the order of their numbers; none where there is no folder.
std::vector<std::filesystem::path> journal_files(const std::filesystem::path& folder);

/// Throws std::runtime_error that names the folder if there is no journal, or no file of it can be
/// read.
JournalSummary read_journal(const std::filesystem::path& folder, const JournalSink& sink);

}  // namespace topoloc::live
