// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/cloud_files.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace topoloc::simulation {

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

PlyWriter::PlyWriter(std::filesystem::path file)
    : file_(std::move(file)), stream_(file_, std::ios::binary) {
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": cannot be created");
  }
  write_header();
}

// The count is not known before the end: the header keeps room for it.
void PlyWriter::write_header() {
  std::array<char, 256> text{};
  const int length = std::snprintf(
      text.data(), text.size(),
      "ply\nformat binary_little_endian 1.0\nelement vertex %012llu\nproperty float x\n"
      "property float y\nproperty float z\nproperty float intensity\nend_header\n",
      static_cast<unsigned long long>(count_));
  stream_.write(text.data(), length);
}

void PlyWriter::write(const SurveyPoint& point) {
  const std::array<float, 4> row{
      static_cast<float>(point.p_world_m.x()), static_cast<float>(point.p_world_m.y()),
      static_cast<float>(point.p_world_m.z()), 65535.0F * std::clamp(point.intensity, 0.0F, 1.0F)};
  stream_.write(reinterpret_cast<const char*>(row.data()), sizeof(row));
  ++count_;
}

void PlyWriter::close() {
  stream_.seekp(0);
  write_header();
  stream_.close();
  if (!stream_) {
    throw std::runtime_error(file_.string() + ": write error");
  }
}

}  // namespace topoloc::simulation
