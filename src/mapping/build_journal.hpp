// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "mapping/node_maker.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace topoloc::mapping {

/// Finished nodes of a build, on disk: one small map file (or reason of rejection) per node, and
/// the text of all inputs and settings that they depend on.
///
/// Every file appears whole or not at all, so a build may be killed at any moment. Different nodes
/// may be stored from different threads.
class BuildJournal {
 public:
  /// Opens or creates the folder. Nodes in it are kept if they were made with the same `settings`
  /// and thrown away otherwise.
  BuildJournal(std::filesystem::path folder, const std::string& settings, const map::MapInfo& info);

  /// True if the outcome of that frame is stored and intact.
  [[nodiscard]] bool contains(std::size_t frame) const;
  void store(std::size_t frame, const NodeOutcome& outcome) const;
  /// Throws if there is none.
  [[nodiscard]] NodeOutcome load(std::size_t frame) const;
  /// Deletes the folder.
  void remove() const;

 private:
  [[nodiscard]] std::filesystem::path node_file(std::size_t frame) const;
  [[nodiscard]] std::filesystem::path reject_file(std::size_t frame) const;

  std::filesystem::path folder_;
  map::MapInfo info_;
};

}  // namespace topoloc::mapping
