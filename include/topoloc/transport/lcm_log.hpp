// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lcm/lcm-cpp.hpp>

/// LCM event logs (lcm-logger, lcm-logplayer).
namespace topoloc::transport {

inline constexpr std::size_t kMaxChannelBytes = 63;  ///< LCM_MAX_CHANNEL_NAME_LENGTH

/// Points into the mapped file: valid as long as its reader.
struct LogEvent {
  std::int64_t time_us = 0;  ///< Unix time of reception
  std::string_view channel;
  std::span<const std::byte> data;
};

/// What could not be read. A log cut off by a power loss has a truncated last event.
struct LogDamage {
  std::uint64_t corrupt_regions = 0;  ///< stretches skipped to get back in step
  std::uint64_t skipped_bytes = 0;    ///< in these, and in the truncated event
  bool truncated = false;
  std::string first;  ///< "FILE: byte OFFSET: ..." of the first; empty if the log is sound
};

/// Random access to a log. Reads headers at opening and payloads not before they are asked for.
/// (LCM's own reader allocates whatever size a corrupt header states and cannot tell a cut-off log
/// from its end.)
class LcmLogReader {
 public:
  /// Throws std::runtime_error if the file cannot be read or holds no whole event.
  explicit LcmLogReader(const std::filesystem::path& file);
  ~LcmLogReader();
  LcmLogReader(LcmLogReader&& other) noexcept;
  LcmLogReader& operator=(LcmLogReader&& other) noexcept;

  [[nodiscard]] std::size_t size() const { return offsets_.size(); }
  /// In the file's order; throws std::out_of_range.
  [[nodiscard]] LogEvent event(std::size_t index) const;
  /// Indices of a channel's events in the file's order; empty for an unknown channel.
  [[nodiscard]] std::span<const std::size_t> events_on(std::string_view channel) const;
  [[nodiscard]] std::vector<std::string> channels() const;
  [[nodiscard]] const LogDamage& damage() const { return damage_; }

 private:
  void index(const std::filesystem::path& file);
  [[nodiscard]] LogEvent event_at(std::uint64_t offset) const;

  std::span<const std::byte> bytes_;  ///< the mapping
  std::vector<std::uint64_t> offsets_;
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_channel_;
  LogDamage damage_;
};

/// Writes a log that lcm-logplayer reads.
class LcmLogWriter {
 public:
  /// Throws std::runtime_error if the file cannot be created.
  explicit LcmLogWriter(const std::filesystem::path& file);
  /// Throws std::runtime_error on a write error and std::invalid_argument on an empty or too long
  /// channel name or a payload beyond 2 GiB.
  void write(std::int64_t time_us, const std::string& channel, std::span<const std::byte> data);
  /// Flushes and throws std::runtime_error if anything was not written. Without it the destructor
  /// closes silently.
  void close();

 private:
  std::filesystem::path file_;
  std::unique_ptr<lcm::LogFile> log_;
};

}  // namespace topoloc::transport
