// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>

#include <Eigen/Core>

namespace topoloc::simulation {

/// A point of a survey.
struct SurveyPoint {
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();
  float intensity = 0.0F;    ///< 0 to 1
  std::int64_t time_ns = 0;  ///< Unix time
};

/// LAZ: LAS 1.4, point format 6, millimetres, intensity 0 to 65535, time as adjusted standard GPS
/// time. All members throw std::runtime_error that names the file.
class LazWriter {
 public:
  explicit LazWriter(const std::filesystem::path& file);
  LazWriter(const LazWriter&) = delete;
  LazWriter& operator=(const LazWriter&) = delete;
  ~LazWriter();

  void write(const SurveyPoint& point);
  void close();

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
};

/// PLY, binary little endian: float32 x y z intensity (0 to 65535, as in the LAZ file). Coordinates
/// beyond some kilometres lose millimetres. Members throw as LazWriter's.
class PlyWriter {
 public:
  explicit PlyWriter(std::filesystem::path file);
  void write(const SurveyPoint& point);
  void close();

 private:
  void write_header();

  std::filesystem::path file_;
  std::ofstream stream_;
  std::uint64_t count_ = 0;
};

}  // namespace topoloc::simulation
