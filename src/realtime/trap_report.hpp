// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

namespace topoloc::realtime::detail {

/// Writes which call the calling thread made although it must not, and the stack, and aborts.
/// Must not be inside ForbidBlocking any more.
[[noreturn]] void report_trap(const char* call);

/// The C library has no such function to stand before: writes so, and aborts.
[[noreturn]] void report_missing(const char* call);

}  // namespace topoloc::realtime::detail
