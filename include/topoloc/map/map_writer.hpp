// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace topoloc::map {

/// Writes a map file node by node; memory stays at 192 bytes a node.
///
/// The file appears under its name only when finish() returns: until then everything is in a
/// temporary file beside it, which the destructor removes. The same input gives the same bytes.
/// All members throw MapError; a node that is refused leaves the writer as it was.
class MapWriter {
 public:
  MapWriter(const std::filesystem::path& path, const MapInfo& info);
  ~MapWriter();
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;

  /// Appends a node. Refuses: times not strictly increasing, poses not finite or not rotations,
  /// covariances not symmetric positive semi-definite, features outside the image or not finite,
  /// descriptors that do not fit the features, counts above the limits of types.hpp.
  void add(const NodeDraft& draft);

  /// The build report, JSON, that goes into the map; empty (as before the first call): none.
  /// Refuses what is not JSON in UTF-8.
  void set_report(std::string json);

  /// Completes the file, syncs it to disk and renames it into place. Call once, last.
  void finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::map
