// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

namespace topoloc::testing {

/// Writes a binary PLY cloud point by point; the number of points is stated beforehand.
class PlyFile {
 public:
  PlyFile(const std::filesystem::path& path, std::size_t points) : file_(path, std::ios::binary) {
    file_
        << "ply\nformat binary_little_endian 1.0\nelement vertex " << points
        << "\nproperty double x\nproperty double y\nproperty double z\nproperty double intensity\n"
           "end_header\n";
  }
  void add(double x, double y, double z, double intensity) {
    const std::array<double, 4> record{x, y, z, intensity};
    file_.write(reinterpret_cast<const char*>(record.data()), sizeof(record));
  }

 private:
  std::ofstream file_;
};

}  // namespace topoloc::testing
