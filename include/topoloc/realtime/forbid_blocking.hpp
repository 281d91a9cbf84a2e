// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

/// Proof that a thread which must not wait does not: real-time traps.
///
/// In a build with the CMake option TOPOLOC_RT_TRAPS (preset `traps`), a thread inside a
/// ForbidBlocking scope that allocates or frees memory, maps memory, or touches a lock, condition,
/// semaphore or futex ends the process by abort(), after a message that names thread and call, and
/// a stack trace. In all other builds the scopes are empty and cost nothing.
///
/// What is caught: see src/realtime/traps.cpp. docs/real-time.md tells how to run it.
namespace topoloc::realtime {

#ifdef TOPOLOC_RT_TRAPS
inline constexpr bool kTrapsBuiltIn = true;
#else
inline constexpr bool kTrapsBuiltIn = false;
#endif

namespace detail {

/// Of the calling thread: scopes it is in. Zero: it may do anything.
int forbidden_depth();
/// Sets it, and returns what it was.
int exchange_forbidden_depth(int depth);

}  // namespace detail

/// From construction to destruction the calling thread must not block or allocate. Scopes nest; a
/// scope ends in the thread that began it.
class ForbidBlocking {
 public:
  ForbidBlocking() {
    if constexpr (kTrapsBuiltIn) {
      detail::exchange_forbidden_depth(detail::forbidden_depth() + 1);
    }
  }
  ~ForbidBlocking() {
    if constexpr (kTrapsBuiltIn) {
      detail::exchange_forbidden_depth(detail::forbidden_depth() - 1);
    }
  }
  ForbidBlocking(const ForbidBlocking&) = delete;
  ForbidBlocking& operator=(const ForbidBlocking&) = delete;
};

/// An exception inside ForbidBlocking, for tests and for the end of a thread: its scope allows
/// everything again.
class AllowBlocking {
 public:
  AllowBlocking() {
    if constexpr (kTrapsBuiltIn) {
      depth_ = detail::exchange_forbidden_depth(0);
    }
  }
  ~AllowBlocking() {
    if constexpr (kTrapsBuiltIn) {
      detail::exchange_forbidden_depth(depth_);
    }
  }
  AllowBlocking(const AllowBlocking&) = delete;
  AllowBlocking& operator=(const AllowBlocking&) = delete;

 private:
  [[maybe_unused]] int depth_ = 0;
};

/// The calling thread is inside ForbidBlocking; always false without traps.
[[nodiscard]] inline bool blocking_forbidden() {
  if constexpr (kTrapsBuiltIn) {
    return detail::forbidden_depth() > 0;
  }
  return false;
}

}  // namespace topoloc::realtime
