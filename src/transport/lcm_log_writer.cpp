// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/lcm_log.hpp"

#include <cstdio>
#include <limits>
#include <stdexcept>

namespace topoloc::transport {

LcmLogWriter::LcmLogWriter(const std::filesystem::path& file)
    : file_(file), log_(std::make_unique<lcm::LogFile>(file.string(), "w")) {
  if (!log_->good()) {
    throw std::runtime_error(file.string() + ": cannot create LCM log");
  }
}

void LcmLogWriter::write(std::int64_t time_us, const std::string& channel,
                         std::span<const std::byte> data) {
  if (log_ == nullptr) {
    throw std::logic_error(file_.string() + ": LCM log is closed");
  }
  if (channel.empty() || channel.size() > kMaxChannelBytes) {
    throw std::invalid_argument("LCM channel '" + channel + "': 1 to 63 characters expected");
  }
  if (data.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw std::invalid_argument("LCM channel '" + channel + "': payload beyond 2 GiB");
  }
  lcm::LogEvent event{};
  event.timestamp = time_us;
  event.channel = channel;
  event.datalen = static_cast<std::int32_t>(data.size());
  event.data = const_cast<std::byte*>(data.data());  // LCM only reads it
  if (log_->writeEvent(&event) != 0) {
    throw std::runtime_error(file_.string() + ": write error, the LCM log is incomplete");
  }
}

void LcmLogWriter::close() {
  if (log_ == nullptr) {
    return;
  }
  const bool written = std::fflush(log_->getFilePtr()) == 0;
  log_.reset();
  if (!written) {
    throw std::runtime_error(file_.string() + ": write error, the LCM log is incomplete");
  }
}

}  // namespace topoloc::transport
