// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/realtime/forbid_blocking.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <malloc.h>
#include <memory>
#include <mutex>
#include <new>
#include <ostream>
#include <pthread.h>
#include <semaphore.h>
#include <semaphore>
#include <shared_mutex>
#include <string>
#include <sys/mman.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {

inline constexpr timespec kPast{.tv_sec = 0, .tv_nsec = 0};

/// Everything the calls work on, made beforehand; locks are free, so that nothing waits.
struct CallSubjects {
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_rwlock_t rwlock = PTHREAD_RWLOCK_INITIALIZER;
  pthread_cond_t condition = PTHREAD_COND_INITIALIZER;
  pthread_spinlock_t spinlock{};
  pthread_barrier_t barrier{};
  sem_t semaphore{};
  void* block = std::malloc(100);
  void* page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  std::mutex std_mutex;
  std::timed_mutex std_timed_mutex;
  std::shared_mutex std_shared_mutex;
  std::condition_variable std_condition;
  std::counting_semaphore<> std_semaphore{0};
  std::vector<int> vector;
  std::string text = std::string(100, 'x');
  std::unique_ptr<int> owned = std::make_unique<int>(1);
  pthread_t ended{};
  bool joined = false;
  // Where calls put what they get, volatile lest the compiler leaves them out.
  void* volatile allocated = nullptr;
  void* volatile mapped = nullptr;

  CallSubjects() {
    pthread_spin_init(&spinlock, PTHREAD_PROCESS_PRIVATE);
    pthread_barrier_init(&barrier, nullptr, 1);
    sem_init(&semaphore, 0, 5);
    pthread_create(
        &ended, nullptr, [](void*) -> void* { return nullptr; }, nullptr);
  }
  ~CallSubjects() {
    std::free(block);
    std::free(allocated);
    munmap(page, 4096);
    munmap(mapped, 4096);
    if (!joined) {
      pthread_join(ended, nullptr);
    }
    sem_destroy(&semaphore);
    pthread_barrier_destroy(&barrier);
    pthread_spin_destroy(&spinlock);
    pthread_cond_destroy(&condition);
    pthread_rwlock_destroy(&rwlock);
    pthread_mutex_destroy(&mutex);
  }
  CallSubjects(const CallSubjects&) = delete;
  CallSubjects& operator=(const CallSubjects&) = delete;
};

struct BlockingCall {
  const char* name;    ///< of the test
  const char* caught;  ///< the function that the message names
  std::function<void(CallSubjects&)> make;
};

inline std::ostream& operator<<(std::ostream& out, const BlockingCall& call) {
  return out << call.name;
}

// As plain C calls and as C++ makes them.
inline const std::vector<BlockingCall>& blocking_calls() {
  static const std::vector<BlockingCall> all = {
      {"malloc", "malloc", [](CallSubjects& f) { f.allocated = std::malloc(10); }},
      {"calloc", "calloc", [](CallSubjects& f) { f.allocated = std::calloc(10, 10); }},
      {"realloc", "realloc", [](CallSubjects& f) { f.block = std::realloc(f.block, 5000); }},
      {"reallocarray", "reallocarray",
       [](CallSubjects& f) { f.block = reallocarray(f.block, 50, 100); }},
      {"free", "free", [](CallSubjects& f) { std::free(std::exchange(f.block, nullptr)); }},
      {"aligned_alloc", "aligned_alloc",
       [](CallSubjects& f) { f.allocated = std::aligned_alloc(64, 64); }},
      {"memalign", "memalign", [](CallSubjects& f) { f.allocated = memalign(64, 64); }},
      {"valloc", "valloc", [](CallSubjects& f) { f.allocated = valloc(64); }},
      {"pvalloc", "pvalloc", [](CallSubjects& f) { f.allocated = pvalloc(64); }},
      {"posix_memalign", "posix_memalign",
       [](CallSubjects& f) {
         void* memory = nullptr;
         EXPECT_EQ(posix_memalign(&memory, 64, 64), 0);
         f.allocated = memory;
       }},
      {"operator_new", "malloc",
       [](CallSubjects&) {
         void* volatile memory = ::operator new(10);
         ::operator delete(memory);
       }},
      {"operator_new_aligned", "aligned_alloc",
       [](CallSubjects&) {
         void* volatile memory = ::operator new (128, std::align_val_t{128});
         ::operator delete (memory, std::align_val_t{128});
       }},
      {"operator_delete", "free", [](CallSubjects& f) { f.owned.reset(); }},
      {"vector_growth", "malloc", [](CallSubjects& f) { f.vector.push_back(1); }},
      {"string_copy", "malloc",
       [](CallSubjects& f) { f.vector.push_back(std::string(f.text)[0]); }},
      {"throw", "malloc",
       [](CallSubjects&) {
         try {
           throw 1;
         } catch (int) {
         }
       }},
      {"allocation_inside_libc", "malloc",
       [](CallSubjects& f) { f.allocated = strdup(f.text.c_str()); }},
      {"mmap", "mmap",
       [](CallSubjects& f) {
         f.mapped = mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
       }},
      {"mmap64", "mmap64",
       [](CallSubjects& f) {
         f.mapped = mmap64(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
       }},
      {"munmap", "munmap", [](CallSubjects& f) { EXPECT_EQ(munmap(f.page, 4096), 0); }},
      {"mprotect", "mprotect", [](CallSubjects& f) { EXPECT_EQ(mprotect(f.page, 4096, 0), 0); }},
      {"madvise", "madvise",
       [](CallSubjects& f) { EXPECT_EQ(madvise(f.page, 4096, MADV_DONTNEED), 0); }},
      {"sbrk", "sbrk", [](CallSubjects&) { EXPECT_NE(sbrk(0), nullptr); }},
      {"brk", "brk",
       [](CallSubjects&) {
         void* end = nullptr;
         {
           const AllowBlocking allow;
           end = sbrk(0);
         }
         EXPECT_EQ(brk(end), 0);
       }},
      {"mutex_lock", "pthread_mutex_lock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_mutex_lock(&f.mutex), 0);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"mutex_trylock", "pthread_mutex_trylock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_mutex_trylock(&f.mutex), 0);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"mutex_timedlock", "pthread_mutex_timedlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_mutex_timedlock(&f.mutex, &kPast), 0);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"mutex_clocklock", "pthread_mutex_clocklock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_mutex_clocklock(&f.mutex, CLOCK_MONOTONIC, &kPast), 0);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"std_mutex", "pthread_mutex_lock",
       [](CallSubjects& f) {
         f.std_mutex.lock();
         f.std_mutex.unlock();
       }},
      {"std_mutex_try_lock", "pthread_mutex_trylock",
       [](CallSubjects& f) {
         EXPECT_TRUE(f.std_mutex.try_lock());
         f.std_mutex.unlock();
       }},
      {"std_timed_mutex", "pthread_mutex_clocklock",
       [](CallSubjects& f) {
         EXPECT_TRUE(f.std_timed_mutex.try_lock_for(std::chrono::hours(1)));
         f.std_timed_mutex.unlock();
       }},
      {"spin_lock", "pthread_spin_lock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_spin_lock(&f.spinlock), 0);
         pthread_spin_unlock(&f.spinlock);
       }},
      {"spin_trylock", "pthread_spin_trylock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_spin_trylock(&f.spinlock), 0);
         pthread_spin_unlock(&f.spinlock);
       }},
      {"rwlock_rdlock", "pthread_rwlock_rdlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_rdlock(&f.rwlock), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_tryrdlock", "pthread_rwlock_tryrdlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_tryrdlock(&f.rwlock), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_timedrdlock", "pthread_rwlock_timedrdlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_timedrdlock(&f.rwlock, &kPast), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_clockrdlock", "pthread_rwlock_clockrdlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_clockrdlock(&f.rwlock, CLOCK_MONOTONIC, &kPast), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_wrlock", "pthread_rwlock_wrlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_wrlock(&f.rwlock), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_trywrlock", "pthread_rwlock_trywrlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_trywrlock(&f.rwlock), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_timedwrlock", "pthread_rwlock_timedwrlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_timedwrlock(&f.rwlock, &kPast), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"rwlock_clockwrlock", "pthread_rwlock_clockwrlock",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_rwlock_clockwrlock(&f.rwlock, CLOCK_MONOTONIC, &kPast), 0);
         pthread_rwlock_unlock(&f.rwlock);
       }},
      {"std_shared_mutex", "pthread_rwlock_rdlock",
       [](CallSubjects& f) {
         f.std_shared_mutex.lock_shared();
         f.std_shared_mutex.unlock_shared();
       }},
      {"cond_wait", "pthread_cond_wait",
       [](CallSubjects& f) {
         std::atomic<bool> woken{false};
         std::thread waker;
         {
           const AllowBlocking allow;
           pthread_mutex_lock(&f.mutex);
           waker = std::thread([&] {
             while (!woken.load()) {
               pthread_cond_broadcast(&f.condition);
               std::this_thread::yield();
             }
           });
         }
         EXPECT_EQ(pthread_cond_wait(&f.condition, &f.mutex), 0);
         pthread_mutex_unlock(&f.mutex);
         woken.store(true);
         waker.join();
       }},
      {"cond_timedwait", "pthread_cond_timedwait",
       [](CallSubjects& f) {
         {
           const AllowBlocking allow;
           pthread_mutex_lock(&f.mutex);
         }
         EXPECT_EQ(pthread_cond_timedwait(&f.condition, &f.mutex, &kPast), ETIMEDOUT);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"cond_clockwait", "pthread_cond_clockwait",
       [](CallSubjects& f) {
         {
           const AllowBlocking allow;
           pthread_mutex_lock(&f.mutex);
         }
         EXPECT_EQ(pthread_cond_clockwait(&f.condition, &f.mutex, CLOCK_MONOTONIC, &kPast),
                   ETIMEDOUT);
         pthread_mutex_unlock(&f.mutex);
       }},
      {"cond_signal", "pthread_cond_signal",
       [](CallSubjects& f) { EXPECT_EQ(pthread_cond_signal(&f.condition), 0); }},
      {"cond_broadcast", "pthread_cond_broadcast",
       [](CallSubjects& f) { EXPECT_EQ(pthread_cond_broadcast(&f.condition), 0); }},
      {"std_condition_notify", "pthread_cond_signal",
       [](CallSubjects& f) { f.std_condition.notify_one(); }},
      {"sem_wait", "sem_wait", [](CallSubjects& f) { EXPECT_EQ(sem_wait(&f.semaphore), 0); }},
      {"sem_trywait", "sem_trywait",
       [](CallSubjects& f) { EXPECT_EQ(sem_trywait(&f.semaphore), 0); }},
      {"sem_timedwait", "sem_timedwait",
       [](CallSubjects& f) { EXPECT_EQ(sem_timedwait(&f.semaphore, &kPast), 0); }},
      {"sem_clockwait", "sem_clockwait",
       [](CallSubjects& f) { EXPECT_EQ(sem_clockwait(&f.semaphore, CLOCK_MONOTONIC, &kPast), 0); }},
      {"sem_post", "sem_post", [](CallSubjects& f) { EXPECT_EQ(sem_post(&f.semaphore), 0); }},
      {"std_semaphore_wait", "futex",
       [](CallSubjects& f) {
         EXPECT_FALSE(f.std_semaphore.try_acquire_for(std::chrono::milliseconds(2)));
       }},
      {"pthread_join", "pthread_join",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_join(f.ended, nullptr), 0);
         f.joined = true;
       }},
      {"barrier_wait", "pthread_barrier_wait",
       [](CallSubjects& f) {
         EXPECT_EQ(pthread_barrier_wait(&f.barrier), PTHREAD_BARRIER_SERIAL_THREAD);
       }},
  };
  return all;
}

}  // namespace topoloc::realtime
