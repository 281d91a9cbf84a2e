// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <fstream>
#include <malloc.h>
#include <stdexcept>
#include <string>

namespace topoloc::testing {

/// Peak of this process's resident memory, counted from when the object was made.
class PeakMemory {
 public:
  PeakMemory() {
    ::malloc_trim(0);  // freed memory that the heap keeps would hide what comes
    std::ofstream("/proc/self/clear_refs") << "5";  // sets VmHWM back
    begin_bytes_ = read("VmHWM:");
  }
  [[nodiscard]] std::uint64_t bytes() const { return read("VmHWM:") - begin_bytes_; }

 private:
  static std::uint64_t read(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
      if (std::uint64_t kib = 0; word == key && status >> kib) {
        return kib * 1024;
      }
    }
    throw std::runtime_error("/proc/self/status has no " + key);
  }

  std::uint64_t begin_bytes_ = 0;
};

}  // namespace topoloc::testing
