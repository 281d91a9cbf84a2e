// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/frame_selection.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::drive {
namespace {

TEST(FrameSelection, SelectsFramesByTheirPlace) {
  EXPECT_TRUE(selected(parse_frame_selection("all"), 3));
  EXPECT_TRUE(selected(parse_frame_selection("even"), 2));
  EXPECT_FALSE(selected(parse_frame_selection("even"), 3));
  EXPECT_TRUE(selected(parse_frame_selection("odd"), 3));
  EXPECT_THROW(parse_frame_selection("some"), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::drive
