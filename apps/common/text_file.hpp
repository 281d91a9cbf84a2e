// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>

namespace topoloc::apps {

/// Throws std::runtime_error that names the file.
inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot be read");
  }
  return text;
}

/// Whether a file can be written later on, before work of minutes. Throws std::runtime_error that
/// names the file; changes and leaves nothing.
inline void require_writable(const std::filesystem::path& path) {
  const bool is_new = !std::filesystem::exists(path);
  if (!is_new && !std::filesystem::is_regular_file(path) && !std::filesystem::is_directory(path)) {
    return;  // a pipe would lose its reader
  }
  if (!std::ofstream(path, std::ios::app)) {
    throw std::runtime_error(path.string() + ": cannot write");
  }
  if (is_new) {
    std::filesystem::remove(path);
  }
}

/// Writes a text to a file, or to stdout where its name is "-". Throws std::runtime_error that
/// names the file.
inline void write_text(const std::filesystem::path& path, std::string_view text) {
  if (path == "-") {
    std::cout << text;
    return;
  }
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error(path.string() + ": cannot write");
  }
}

}  // namespace topoloc::apps
