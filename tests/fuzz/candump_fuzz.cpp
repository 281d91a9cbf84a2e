// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/candump.hpp"

#include <cstdint>
#include <cstdlib>
#include <string_view>

// Any line is a frame or an error; a frame comes back from its own line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace topoloc::can;
  Frame frame;
  if (parse_candump_line({reinterpret_cast<const char*>(data), size}, frame) ==
      CandumpError::kNone) {
    Frame again;
    if (parse_candump_line(format_candump_line(frame), again) != CandumpError::kNone ||
        again != frame) {
      std::abort();
    }
  }
  return 0;
}
