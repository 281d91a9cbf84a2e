// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/dbc.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::can {

/// The DBC files of one vehicle: buses often come with a file each.
class DbcSet {
 public:
  /// Throws as Dbc::load does, and where there is no file at all.
  explicit DbcSet(const std::vector<std::filesystem::path>& files);

  /// The signal, which must be in one of the files only, for use on an interface (empty: any).
  /// Throws std::runtime_error where it is in none or in several, or where its message has the id
  /// of another message already in use that the interface does not tell apart.
  SignalRef signal(std::string_view message_dot_signal, std::string_view interface);
  [[nodiscard]] const std::vector<Dbc>& all() const { return dbcs_; }

 private:
  struct UsedMessage {
    const Message* message;
    std::string interface;
  };
  void note_use(const Message& message, std::string_view interface);

  std::string name_;  ///< the file names, as error messages begin
  std::vector<Dbc> dbcs_;
  std::vector<UsedMessage> used_;
};

}  // namespace topoloc::can
