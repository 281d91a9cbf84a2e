// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/frame_selection.hpp"

#include <stdexcept>

namespace topoloc::drive {

FrameSelection parse_frame_selection(const std::string& text) {
  if (text == "all") {
    return FrameSelection::kAll;
  }
  if (text == "even") {
    return FrameSelection::kEven;
  }
  if (text == "odd") {
    return FrameSelection::kOdd;
  }
  throw std::invalid_argument("frames: expected all, even or odd, found '" + text + "'");
}

bool selected(FrameSelection selection, std::size_t index) {
  switch (selection) {
    case FrameSelection::kAll:
      return true;
    case FrameSelection::kEven:
      return index % 2 == 0;
    case FrameSelection::kOdd:
      return index % 2 == 1;
  }
  return false;
}

}  // namespace topoloc::drive
