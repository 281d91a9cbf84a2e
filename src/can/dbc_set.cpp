// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/dbc_set.hpp"

#include <stdexcept>

namespace topoloc::can {

DbcSet::DbcSet(const std::vector<std::filesystem::path>& files) {
  if (files.empty()) {
    throw std::runtime_error("no DBC file is configured");
  }
  for (const auto& file : files) {
    name_ += (name_.empty() ? "" : ", ") + file.string();
    dbcs_.push_back(Dbc::load(file));
  }
}

SignalRef DbcSet::signal(std::string_view message_dot_signal, std::string_view interface) {
  std::vector<SignalRef> found;
  std::string complaints;
  for (const Dbc& dbc : dbcs_) {
    try {
      found.push_back(dbc.signal(message_dot_signal));
    } catch (const std::runtime_error& error) {
      complaints += (complaints.empty() ? "" : "; ") + std::string(error.what());
    }
  }
  if (found.empty()) {
    throw std::runtime_error(complaints);
  }
  if (found.size() > 1) {
    throw std::runtime_error(name_ + ": signal '" + std::string(message_dot_signal) + "' is in " +
                             std::to_string(found.size()) + " of these files");
  }
  note_use(*found.front().message, interface);
  return found.front();
}

void DbcSet::note_use(const Message& message, std::string_view interface) {
  for (const UsedMessage& used : used_) {
    const bool same_frames =
        used.message->id == message.id && used.message->extended == message.extended &&
        (used.interface.empty() || interface.empty() || used.interface == interface);
    if (same_frames && used.message != &message) {
      throw std::runtime_error(name_ + ": messages '" + used.message->name + "' and '" +
                               message.name + "' both have id " + std::to_string(message.id) +
                               "; give them different interfaces");
    }
  }
  used_.push_back({&message, std::string(interface)});
}

}  // namespace topoloc::can
