// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/pose_refiner.hpp"

#include "mapping/node_maker.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::mapping {

/// What a build has finished, on disk: refined poses, one small map file (or reason of rejection)
/// per node, and the text of all inputs and settings that they depend on.
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
  /// Refined poses, found with these settings of theirs.
  void store_poses(const std::vector<RefinedPose>& poses, const std::string& settings) const;
  /// Deletes the folder.
  void remove() const;

  /// Poses that an interrupted build has left in such a folder, if it found them with the same
  /// settings; whatever its nodes were made with.
  static std::optional<std::vector<RefinedPose>> load_poses(const std::filesystem::path& folder,
                                                            const std::string& settings);

 private:
  [[nodiscard]] std::filesystem::path node_file(std::size_t frame) const;
  [[nodiscard]] std::filesystem::path reject_file(std::size_t frame) const;

  std::filesystem::path folder_;
  map::MapInfo info_;
};

}  // namespace topoloc::mapping
