// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/forbid_blocking.hpp"

#include "blocking_calls.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <pthread.h>
#include <string>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

class Traps : public ::testing::TestWithParam<BlockingCall> {};
class TrapsDeathTest : public ::testing::TestWithParam<BlockingCall> {};

TEST_P(TrapsDeathTest, FiresInsideForbidBlocking) {
  const auto forbidden = [] {
    CallSubjects subjects;
    const ForbidBlocking forbid;
    GetParam().make(subjects);
  };
  EXPECT_EXIT(forbidden(), ::testing::KilledBySignal(SIGABRT),
              std::string("real-time trap: thread '.*' called ") + GetParam().caught +
                  "\\(\\) where blocking");
}

// In builds without traps: anywhere.
TEST_P(Traps, PassesWhereAllowed) {
  CallSubjects subjects;
  if (kTrapsBuiltIn) {
    GetParam().make(subjects);
    CallSubjects again;
    const ForbidBlocking forbid;
    const AllowBlocking allow;
    GetParam().make(again);
  } else {
    const ForbidBlocking forbid;
    EXPECT_FALSE(blocking_forbidden());
    GetParam().make(subjects);
  }
}

std::string name_of(const ::testing::TestParamInfo<BlockingCall>& tested) {
  return tested.param.name;
}

std::vector<BlockingCall> all_if(bool wanted) {
  return wanted ? blocking_calls() : std::vector<BlockingCall>();
}

#ifdef __SANITIZE_THREAD__
// GCC's does not know pthread_mutex_clocklock and takes the unlocking after it for an error.
constexpr bool kThreadSanitizer = true;
#else
constexpr bool kThreadSanitizer = false;
#endif

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(TrapsDeathTest);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Traps);
INSTANTIATE_TEST_SUITE_P(EveryCall, TrapsDeathTest, ::testing::ValuesIn(all_if(kTrapsBuiltIn)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(EveryCall, Traps, ::testing::ValuesIn(all_if(!kThreadSanitizer)), name_of);

class TrapScopeDeathTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!kTrapsBuiltIn) {
      GTEST_SKIP() << "built without TOPOLOC_RT_TRAPS";
    }
  }
};

TEST_F(TrapScopeDeathTest, EndsWithTheScopeAndNests) {
  EXPECT_FALSE(blocking_forbidden());
  std::array<bool, 4> forbidden{};
  {
    const ForbidBlocking outer;
    forbidden[0] = blocking_forbidden();
    {
      const ForbidBlocking inner;
      forbidden[1] = blocking_forbidden();
      const AllowBlocking allow;
      forbidden[2] = blocking_forbidden();
    }
    forbidden[3] = blocking_forbidden();
  }
  EXPECT_EQ(forbidden, (std::array<bool, 4>{true, true, false, true}));
  EXPECT_FALSE(blocking_forbidden());
}

TEST_F(TrapScopeDeathTest, DoesNotConcernOtherThreads) {
  std::atomic<bool> forbidden{false};
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> spins{0};
  std::thread realtime([&] {
    const ForbidBlocking forbid;
    forbidden.store(true);
    while (!done.load()) {
      spins.fetch_add(1);
      const timespec pause{.tv_sec = 0, .tv_nsec = 100'000};
      clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr);
    }
  });
  while (!forbidden.load()) {
    std::this_thread::yield();
  }
  for (const BlockingCall& call : blocking_calls()) {
    CallSubjects subjects;
    call.make(subjects);
  }
  done.store(true);
  realtime.join();
  EXPECT_GT(spins.load(), 0U);
}

TEST_F(TrapScopeDeathTest, LetsThroughWhatNeitherBlocksNorAllocates) {
  CallSubjects subjects;
  pthread_mutex_lock(&subjects.mutex);
  std::array<int, 2> descriptors{};
  ASSERT_EQ(pipe(descriptors.data()), 0);
  subjects.vector.reserve(10);
  ssize_t moved = 0;
  {
    const ForbidBlocking forbid;
    std::free(nullptr);
    std::vector<int> empty;
    empty.swap(subjects.vector);
    empty.push_back(1);
    empty.swap(subjects.vector);
    pthread_mutex_unlock(&subjects.mutex);
    const char byte = 'x';
    char back = 0;
    moved = write(descriptors[1], &byte, 1) + read(descriptors[0], &back, 1);
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    syscall(SYS_getpid);
  }
  EXPECT_EQ(moved, 2);
}

}  // namespace

/// Of a name that a stack trace can show.
[[gnu::noinline]] void allocates_where_it_must_not() {
  void* volatile memory = std::malloc(10);
  std::free(memory);
}

namespace {

TEST_F(TrapScopeDeathTest, TellsThreadCallAndStack) {
  const auto forbidden = [] {
    pthread_setname_np(pthread_self(), "estimator");
    const ForbidBlocking forbid;
    allocates_where_it_must_not();
  };
  EXPECT_EXIT(forbidden(), ::testing::KilledBySignal(SIGABRT),
              "thread 'estimator' called malloc\\(\\)(.|\n)*allocates_where_it_must_not");
}

}  // namespace
}  // namespace topoloc::realtime
