// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/thread.hpp"

#include "topoloc/realtime/memory_lock.hpp"

#include "support/without_privileges.hpp"

#include <alloca.h>
#include <array>
#include <atomic>
#include <csignal>
#include <sched.h>
#include <stdexcept>
#include <system_error>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Thread, RunsUnderItsName) {
  std::array<char, 16> name{};
  Thread thread({.name = "fifteen-letters"},
                [&name] { pthread_getname_np(pthread_self(), name.data(), name.size()); });
  thread.start();
  thread.join();
  EXPECT_STREQ(name.data(), "fifteen-letters");
  EXPECT_THAT(thread.warnings(), IsEmpty()) << "nothing was asked for";
}

TEST(Thread, WaitsUntilStarted) {
  std::atomic<bool> ran{false};
  Thread thread({.name = "test"}, [&ran] { ran.store(true); });
  sched_yield();
  EXPECT_FALSE(ran.load());
  thread.start();
  thread.join();
  EXPECT_TRUE(ran.load());
  thread.start();
  thread.join();
}

TEST(Thread, NeverStartedNeverRuns) {
  bool ran = false;
  {
    const Thread thread({.name = "test"}, [&ran] { ran = true; });
  }
  EXPECT_FALSE(ran);
}

TEST(Thread, HasItsPriorityOrSaysThatItHasNot) {
  int policy = -1;
  sched_param param{};
  Thread thread({.name = "test", .fifo_priority = 2},
                [&] { pthread_getschedparam(pthread_self(), &policy, &param); });
  thread.start();
  thread.join();
  if (thread.warnings().empty()) {
    EXPECT_EQ(policy, SCHED_FIFO);
    EXPECT_EQ(param.sched_priority, 2);
  } else {
    EXPECT_EQ(thread.warnings().size(), 1U);
    EXPECT_EQ(policy, SCHED_OTHER);
  }
}

TEST(Thread, WithoutPrivilegeItWarnsOnceAndRuns) {
  test::without_privileges([] {
    bool ran = false;
    Thread thread({.name = "estimator", .fifo_priority = 80}, [&ran] { ran = true; });
    thread.start();
    thread.join();
    EXPECT_TRUE(ran);
    ASSERT_EQ(thread.warnings().size(), 1U);
    EXPECT_THAT(thread.warnings()[0], HasSubstr("thread 'estimator'"));
    EXPECT_THAT(thread.warnings()[0], HasSubstr("priority 80"));
    EXPECT_THAT(thread.warnings()[0], HasSubstr("LimitRTPRIO=80"));
  });
}

TEST(Thread, RunsOnItsCpuOnly) {
  cpu_set_t here;
  CPU_ZERO(&here);
  ASSERT_EQ(sched_getaffinity(0, sizeof here, &here), 0);
  int last = 0;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    last = CPU_ISSET(static_cast<std::size_t>(cpu), &here) ? cpu : last;
  }
  cpu_set_t got;
  CPU_ZERO(&got);
  Thread thread({.name = "test", .cpus = {last}},
                [&got] { sched_getaffinity(0, sizeof got, &got); });
  thread.start();
  thread.join();
  EXPECT_THAT(thread.warnings(), IsEmpty());
  EXPECT_EQ(CPU_COUNT(&got), 1);
  EXPECT_TRUE(CPU_ISSET(static_cast<std::size_t>(last), &got));
}

TEST(Thread, WarnsOfACpuThatIsNotThereAndRuns) {
  bool ran = false;
  Thread thread({.name = "test", .cpus = {CPU_SETSIZE - 1}}, [&ran] { ran = true; });
  thread.start();
  thread.join();
  EXPECT_TRUE(ran);
  ASSERT_EQ(thread.warnings().size(), 1U);
  EXPECT_THAT(thread.warnings()[0], HasSubstr("was to run on CPU 1023 only"));
}

TEST(Thread, LeavesSignalsToOthers) {
  sigset_t inside;
  sigemptyset(&inside);
  Thread thread({.name = "test"}, [&inside] { pthread_sigmask(SIG_BLOCK, nullptr, &inside); });
  thread.start();
  thread.join();
  EXPECT_EQ(sigismember(&inside, SIGTERM), 1);
  EXPECT_EQ(sigismember(&inside, SIGINT), 1);
  EXPECT_EQ(sigismember(&inside, SIGSEGV), 0);
  sigset_t outside;
  sigemptyset(&outside);
  pthread_sigmask(SIG_BLOCK, nullptr, &outside);
  EXPECT_EQ(sigismember(&outside, SIGTERM), 0) << "the creating thread's are as before";
}

[[gnu::noinline]] void use_stack(std::size_t bytes) {
  auto* block = static_cast<volatile char*>(alloca(bytes));
  for (std::size_t at = 0; at < bytes; at += 1024) {
    block[at] = 1;
  }
}

TEST(Thread, ItsWholeStackIsInMemoryBeforehand) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers have page faults of their own";
#endif
  constexpr std::size_t kStack = 1024 * 1024;
  PageFaults faults;
  Thread thread({.name = "test", .stack_bytes = kStack}, [&faults] {
    use_stack(1);  // the code itself may have to be read in
    const PageFaults before = thread_page_faults();
    use_stack(kStack - 32 * 1024);
    faults = thread_page_faults();
    faults.minor -= before.minor;
    faults.major -= before.major;
  });
  thread.start();
  thread.join();
  EXPECT_EQ(faults.minor, 0U);
  EXPECT_EQ(faults.major, 0U);
}

TEST(Thread, RefusesConfigsOutOfRange) {
  const auto none = [] {};
  EXPECT_THROW(Thread({.name = ""}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "sixteen-letters!"}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "a", .fifo_priority = 100}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "a", .fifo_priority = -1}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "a", .cpus = {-1}}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "a", .cpus = {CPU_SETSIZE}}, none), std::invalid_argument);
  EXPECT_THROW(Thread({.name = "a", .stack_bytes = 1000}, none), std::invalid_argument);
}

TEST(Thread, NamesItselfWhenThereIsNoMemoryForIt) {
  try {
    Thread({.name = "huge", .stack_bytes = std::size_t{1} << 50}, [] {});
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("thread 'huge' with a stack of"));
  }
}

}  // namespace
}  // namespace topoloc::realtime
