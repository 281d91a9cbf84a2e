// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_folder.hpp"

#include <stdexcept>

namespace topoloc::simulation {
namespace fs = std::filesystem;

void require_free(const fs::path& out, bool force) {
  if (!fs::exists(out)) {
    return;
  }
  if (!fs::is_directory(out)) {
    throw std::runtime_error(out.string() + " exists and is not a folder");
  }
  if (fs::is_empty(out)) {
    return;
  }
  if (!fs::exists(out / "vehicle.yaml")) {
    throw std::runtime_error(out.string() + " exists and is not a drive folder");
  }
  if (!force) {
    throw std::runtime_error(out.string() + " exists (--force replaces it)");
  }
}

void create_folder(const fs::path& given, bool force,
                   const std::function<void(const fs::path&)>& fill) {
  fs::path out = fs::absolute(given).lexically_normal();
  if (!out.has_filename()) {  // "drive/"
    out = out.parent_path();
  }
  require_free(out, force);
  fs::create_directories(out.parent_path());
  fs::path partial = out;
  partial += ".partial";
  fs::remove_all(partial);
  fs::create_directory(partial);
  try {
    fill(partial);
    fs::remove_all(out);
    fs::rename(partial, out);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(partial, ignored);
    throw;
  }
}

}  // namespace topoloc::simulation
