// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/thread.hpp"

#include "topoloc/realtime/memory_lock.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <sched.h>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <system_error>
#include <utility>

namespace topoloc::realtime {

namespace {

constexpr std::size_t kMinStackBytes = std::size_t{64} * 1024;

void check(const ThreadConfig& config) {
  const auto fail = [&config](const std::string& what) {
    throw std::invalid_argument("thread '" + config.name + "': " + what);
  };
  if (config.name.empty() || config.name.size() > 15) {
    fail("its name must have 1 to 15 characters, found " + std::to_string(config.name.size()));
  }
  if (config.fifo_priority < 0 || config.fifo_priority > 99) {
    fail("its priority must be 0 to 99, found " + std::to_string(config.fifo_priority));
  }
  if (config.stack_bytes < kMinStackBytes) {
    fail("its stack must have at least 65536 bytes, found " + std::to_string(config.stack_bytes));
  }
  for (const int cpu : config.cpus) {
    if (cpu < 0 || cpu >= CPU_SETSIZE) {
      fail("CPUs are 0 to " + std::to_string(CPU_SETSIZE - 1) + ", found " + std::to_string(cpu));
    }
  }
}

std::string listed(const cpu_set_t& cpus) {
  std::string list;
  for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &cpus)) {
      list += (list.empty() ? "" : ",") + std::to_string(cpu);
    }
  }
  return list;
}

/// Blocks what is sent to the process from outside; what the thread itself causes stays, and
/// SIGPROF, which profilers send to each thread.
sigset_t outside_signals() {
  sigset_t signals;
  sigfillset(&signals);
  for (const int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS, SIGPROF}) {
    sigdelset(&signals, own);
  }
  return signals;
}

}  // namespace

Thread::Thread(ThreadConfig config, std::function<void()> entry)
    : config_(std::move(config)), entry_(std::move(entry)) {
  check(config_);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, config_.stack_bytes);
  // A thread inherits the mask: there is no moment in which it could be given such a signal.
  const sigset_t blocked = outside_signals();
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, &blocked, &before);
  const int error = pthread_create(&handle_, &attributes, &Thread::enter, this);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  pthread_attr_destroy(&attributes);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(),
                            "thread '" + config_.name + "' with a stack of " +
                                std::to_string(config_.stack_bytes) + " bytes: cannot create it");
  }
  stage_.wait(Stage::kPreparing, std::memory_order_acquire);
}

Thread::~Thread() { join(); }

void Thread::start() {
  if (stage_.load(std::memory_order_relaxed) == Stage::kPrepared) {
    advance(Stage::kRun);
  }
}

void Thread::join() {
  if (joined_) {
    return;
  }
  if (stage_.load(std::memory_order_relaxed) == Stage::kPrepared) {
    advance(Stage::kCancelled);
  }
  pthread_join(handle_, nullptr);
  joined_ = true;
}

void Thread::advance(Stage stage) {
  stage_.store(stage, std::memory_order_release);
  stage_.notify_all();
}

void* Thread::enter(void* self) {
  auto& thread = *static_cast<Thread*>(self);
  thread.prepare();
  thread.advance(Stage::kPrepared);
  thread.stage_.wait(Stage::kPrepared, std::memory_order_acquire);
  if (thread.stage_.load(std::memory_order_acquire) == Stage::kRun) {
    thread.entry_();
  }
  return nullptr;
}

// CPUs before the stack, so that its pages come from memory next to the core.
void Thread::prepare() {
  pthread_setname_np(pthread_self(), config_.name.c_str());
  set_cpus();
  // Ordinary threads are woken up to 50 us late, to save power; real-time ones are not.
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  prefault_stack(config_.stack_bytes);
  set_priority();
}

void Thread::set_cpus() {
  if (config_.cpus.empty()) {
    return;
  }
  cpu_set_t allowed;
  cpu_set_t wanted;
  CPU_ZERO(&allowed);
  CPU_ZERO(&wanted);
  for (const int cpu : config_.cpus) {
    CPU_SET(static_cast<std::size_t>(cpu), &wanted);
  }
  pthread_getaffinity_np(pthread_self(), sizeof allowed, &allowed);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof wanted, &wanted);
  cpu_set_t got;
  CPU_ZERO(&got);
  pthread_getaffinity_np(pthread_self(), sizeof got, &got);
  // Without an error the kernel leaves out those that are not there.
  if (error != 0 || !CPU_EQUAL(&got, &wanted)) {
    warnings_.push_back("thread '" + config_.name + "' was to run on CPU " + listed(wanted) +
                        " only and runs on " + listed(got) + ": this process was given CPU " +
                        listed(allowed) + ". Check the CPUs in the configuration, isolcpus, and " +
                        "AllowedCPUs= or CPUAffinity= of the systemd unit.");
  }
}

void Thread::set_priority() {
  if (config_.fifo_priority == 0) {
    return;
  }
  const sched_param param{.sched_priority = config_.fifo_priority};
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
  if (error == 0) {
    return;
  }
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  warnings_.push_back("thread '" + config_.name + "' was to have real-time priority " +
                      std::to_string(config_.fifo_priority) + " and runs without (" +
                      std::generic_category().message(error) + "; the limit, ulimit -r, is " +
                      std::to_string(limit.rlim_cur) + "): other programs can delay it. Set " +
                      "LimitRTPRIO=" + std::to_string(config_.fifo_priority) +
                      " in the systemd unit, or give the program CAP_SYS_NICE.");
}

}  // namespace topoloc::realtime
