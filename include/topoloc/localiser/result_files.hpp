// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/localiser/batch.hpp"

#include <filesystem>
#include <memory>
#include <span>

namespace topoloc::localiser {

/// The files of one run, written while it goes, so that a long one needs no memory for them:
/// - EST.tum: the pose T_world_imu of every tick;
/// - EST.states.csv: full state, mode and pose covariance of every tick (upper triangle, order
///   theta [rad, IMU axes], p [m, world axes]);
/// - EST.updates.csv: matching and update figures of every frame. min_information_* are the
///   smallest diagonal elements of the information that its matches brought [1/rad^2, 1/m^2].
///
/// They have these names once finish() was called. Until then they end in ".partial", and the
/// destructor removes them. All members throw std::runtime_error that names the file.
class ResultFiles {
 public:
  /// `trajectory`: EST.tum, or EST.
  explicit ResultFiles(const std::filesystem::path& trajectory);
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  void add(const estimation::Estimate& estimate);
  void finish(std::span<const FrameRecord> frames);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::localiser
