// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/journal.hpp"

#include "topoloc/transport/lcm_log.hpp"

#include "live/journal_messages.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <topoloc/journal_start_t.hpp>
#include <vector>

#include <fmt/core.h>

namespace topoloc::live {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStart = "JOURNAL_START";
constexpr const char* kTick = "JOURNAL_TICK";
constexpr const char* kMatchSet = "JOURNAL_MATCH_SET";
constexpr std::size_t kFiles = 8;

constexpr std::string_view kStem = "journal_";

/// Nothing where it is no file of a journal.
std::optional<std::uint64_t> number_of_file(const fs::path& path) {
  const std::string stem = path.stem().string();
  if (path.extension() != ".lcm" || !stem.starts_with(kStem)) {
    return std::nullopt;
  }
  const char* const end = stem.data() + stem.size();
  std::uint64_t number = 0;
  const auto [last, error] = std::from_chars(stem.data() + kStem.size(), end, number);
  return error == std::errc{} && last == end ? std::optional(number) : std::nullopt;
}

}  // namespace

std::vector<fs::path> journal_files(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (number_of_file(entry.path())) {
        files.push_back(entry.path());
      }
    }
  }
  std::ranges::sort(files, {}, number_of_file);
  return files;
}

struct JournalWriter::Impl {
  fs::path folder;
  std::size_t max_file_bytes;
  Origin origin;
  std::size_t file_number = 0;
  std::size_t file_bytes = 0;
  std::optional<transport::LcmLogWriter> log;
  std::optional<estimation::InitialPose> pose;  ///< after the newest tick
  tick_t tick;
  match_set_t match_set;
  std::vector<std::byte> encoded;

  template <typename Message>
  void write(const char* channel, std::int64_t time_us, const Message& message) {
    encoded.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(encoded.data(), 0, static_cast<int>(encoded.size()));
    log->write(time_us, channel, encoded);
    constexpr std::size_t kEventHeaderBytes = 28;
    file_bytes += kEventHeaderBytes + std::char_traits<char>::length(channel) + encoded.size();
  }

  void next_file(std::int64_t time_us) {
    if (log) {
      log->close();
    }
    ++file_number;
    log.emplace(folder / fmt::format("journal_{:06}.lcm", file_number));
    file_bytes = 0;
    if (file_number > kFiles) {
      std::error_code ignored;
      fs::remove(folder / fmt::format("journal_{:06}.lcm", file_number - kFiles), ignored);
    }
    journal_start_t start;
    start.utime = time_us;
    start.from_start = static_cast<std::int8_t>(file_number == 1 ? 1 : 0);
    start.version = origin.version;
    start.vehicle_yaml = origin.vehicle_yaml;
    start.with_map = static_cast<std::int8_t>(origin.with_map ? 1 : 0);
    set_pose(pose, start);
    write(kStart, time_us, start);
  }

  /// Between ticks only.
  void turn_over_if_full(std::int64_t time_us) {
    if (!log || file_bytes > max_file_bytes) {
      next_file(time_us);
    }
  }
};

JournalWriter::JournalWriter(fs::path folder, std::size_t max_bytes, Origin origin)
    : impl_(std::make_unique<Impl>()) {
  std::error_code error;
  const fs::path previous = folder / "previous";
  fs::create_directories(folder, error);
  const std::vector<fs::path> old = error ? std::vector<fs::path>{} : journal_files(folder);
  if (!old.empty()) {
    fs::remove_all(previous, error);
    fs::create_directory(previous, error);
  }
  for (std::size_t i = 0; i < old.size() && !error; ++i) {
    fs::rename(old[i], previous / old[i].filename(), error);
  }
  if (error) {
    throw std::runtime_error(folder.string() +
                             ": cannot be used for the journal: " + error.message());
  }
  impl_->folder = std::move(folder);
  impl_->max_file_bytes = max_bytes / kFiles;
  impl_->origin = std::move(origin);
  impl_->next_file(0);
}

JournalWriter::~JournalWriter() = default;

void JournalWriter::add(const NumberedMatchSet& set) {
  to_message(set, impl_->match_set);
  impl_->write(kMatchSet, set.set.frame_time_ns / 1000, impl_->match_set);
}

void JournalWriter::add(const TickInput& tick,
                        const std::optional<estimation::InitialPose>& after) {
  to_message(tick, impl_->tick);
  impl_->write(kTick, tick.now_ns / 1000, impl_->tick);
  impl_->pose = after;
  impl_->turn_over_if_full(tick.now_ns / 1000);
}

void JournalWriter::close() { impl_->log->close(); }

namespace {

/// Reads the events of a journal one after the other.
class JournalReader {
 public:
  explicit JournalReader(const JournalSink& sink) : sink_(sink) {}

  /// What a power cut leaves may be a file with nothing in it: it counts, and the others are read.
  void read(const fs::path& file) {
    const std::uint64_t number = number_of_file(file).value_or(0);
    if (last_number_ && number > *last_number_ + 1) {
      summary_.missing_files += number - *last_number_ - 1;
      gap_ = true;
    }
    last_number_ = number;
    std::optional<transport::LcmLogReader> log;
    try {
      log.emplace(file);
    } catch (const std::runtime_error&) {
      ++summary_.unreadable;
      gap_ = true;
      return;
    }
    ++files_;
    read(*log);
    gap_ = gap_ || log->damage().truncated;
  }

  [[nodiscard]] std::size_t files() const { return files_; }  ///< that could be read
  [[nodiscard]] const JournalSummary& summary() const { return summary_; }

 private:
  void read(const transport::LcmLogReader& log) {
    summary_.unreadable += log.damage().corrupt_regions + (log.damage().truncated ? 1 : 0);
    for (std::size_t i = 0; i < log.size(); ++i) {
      const transport::LogEvent event = log.event(i);
      const bool readable = event.channel == kTick       ? read_tick(event.data)
                            : event.channel == kMatchSet ? read_match_set(event.data)
                            : event.channel == kStart    ? read_start(event.data)
                                                         : true;
      summary_.unreadable += readable ? 0 : 1;
    }
  }

  template <typename Message>
  bool decode(std::span<const std::byte> data, Message& message) {
    // A whole event that begins with another type's fingerprint is not damaged.
    std::int64_t fingerprint = 0;
    const int size = static_cast<int>(data.size());
    const bool has_one = __int64_t_decode_array(data.data(), 0, size, &fingerprint, 1) >= 0;
    if (has_one && fingerprint != Message::getHash()) {
      summary_.other_version = true;
      return false;
    }
    try {
      return message.decode(data.data(), 0, size) >= 0;
    } catch (const std::exception&) {  // a damaged length: more memory than there is
      return false;
    }
  }

  bool read_start(std::span<const std::byte> data) {
    journal_start_t start;
    if (!decode(data, start)) {
      return false;
    }
    const JournalFileStart file{
        .from_start = start.from_start != 0, .after_gap = gap_, .pose = pose_of(start)};
    gap_ = false;
    summary_.from_start = summary_.from_start || (file.from_start && summary_.ticks == 0);
    if (sink_.file) {
      sink_.file(file);
    }
    summary_.vehicle_yaml = start.vehicle_yaml;
    summary_.with_map = start.with_map != 0;
    return true;
  }

  bool read_match_set(std::span<const std::byte> data) {
    NumberedMatchSet set;
    if (!decode(data, set_message_) || !from_message(set_message_, set)) {
      return false;
    }
    sets_.insert_or_assign(set.number, std::move(set.set));
    return true;
  }

  bool read_tick(std::span<const std::byte> data) {
    if (!decode(data, tick_message_) || !from_message(tick_message_, tick_)) {
      return false;
    }
    const auto set = tick_.match_set ? sets_.find(*tick_.match_set) : sets_.end();
    summary_.lost_match_sets += tick_.match_set && set == sets_.end() ? 1 : 0;
    summary_.lost_ticks = tick_.lost_before;
    ++summary_.ticks;
    sink_.tick(tick_, set != sets_.end() ? &set->second : nullptr);
    if (set != sets_.end()) {
      sets_.erase(sets_.begin(), std::next(set));
    }
    return true;
  }

  const JournalSink& sink_;
  JournalSummary summary_;
  std::size_t files_ = 0;
  std::optional<std::uint64_t> last_number_;               // of a file
  bool gap_ = true;                                        // what was before is not known
  std::map<std::uint64_t, estimation::MapMatchSet> sets_;  // not yet taken in
  tick_t tick_message_;
  match_set_t set_message_;
  TickInput tick_;
};

}  // namespace

JournalSummary read_journal(const fs::path& folder, const JournalSink& sink) {
  const std::vector<fs::path> files = journal_files(folder);
  if (files.empty()) {
    throw std::runtime_error(folder.string() + ": no journal (journal_*.lcm) in this folder");
  }
  JournalReader reader(sink);
  for (const fs::path& file : files) {
    reader.read(file);
  }
  if (reader.files() == 0) {
    throw std::runtime_error(folder.string() + ": no file of the journal can be read");
  }
  return reader.summary();
}

}  // namespace topoloc::live
