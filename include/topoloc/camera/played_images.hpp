// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_source.hpp"
#include "topoloc/camera/image_times.hpp"
#include "topoloc/camera/recorded_images.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace topoloc::camera {

/// Plays recorded images in real time, as if a camera saw them now. Every image has a due time on
/// the monotonic clock: one that is late does not make the next one late.
class PlayedImages final : public ImageSource {
 public:
  struct Config {
    bool loop = false;           ///< again and again; stamps go on
    bool keep_stamps = false;    ///< recorded times instead of the present
    std::int64_t offset_ns = 0;  ///< added to all stamps
  };

  /// Throws std::invalid_argument for recorded stamps in a loop: they would go back.
  PlayedImages(std::unique_ptr<RecordedImages> images, ImageTimes times, const Config& config,
               Report report);

  Taken next(image_t& image) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> losses() const override;

 private:
  /// Reads ahead; false at the end.
  bool read();
  bool rewind();

  std::unique_ptr<RecordedImages> images_;
  ImageTimes times_;
  Config config_;
  Report report_;
  std::int64_t start_ns_;     // of the lap, monotonic
  std::size_t index_ = 0;     // of the next image in the lap
  std::size_t readable_ = 0;  // in this lap
  image_t read_{};
  std::optional<std::int64_t> elapsed_ns_;  // of read_
  std::uint64_t unreadable_ = 0;
  std::uint64_t without_stamp_ = 0;
};

}  // namespace topoloc::camera
