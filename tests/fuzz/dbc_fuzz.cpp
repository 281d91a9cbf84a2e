// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/dbc.hpp"

#include <cstdint>
#include <stdexcept>
#include <string_view>

// Any text is a DBC or a std::runtime_error; every signal of a DBC can be looked at.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace topoloc::can;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::uint8_t payload[64] = {1, 2, 3};
  try {
    const Dbc dbc = Dbc::parse(text, "fuzz");
    for (const Message& message : dbc.messages()) {
      for (const Signal& signal : message.signals) {
        (void)decode(signal.coding, payload);
        (void)is_present(message, signal, payload);
      }
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
