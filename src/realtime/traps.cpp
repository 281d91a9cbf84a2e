// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
//
// Real-time traps: this file defines the functions of the C library that a real-time thread must
// not call. The dynamic linker finds those of the program first, whoever calls: our code,
// libstdc++ (operator new and delete end in malloc and free, std::mutex in pthread_mutex_lock), LCM
// or ONNX Runtime. Each asks whether the calling thread is inside ForbidBlocking; if not, it hands
// over to the C library's own.
//
// Caught, too: what the C library's functions allocate (fopen, strdup, getline, exceptions):
// glibc calls malloc and its kin through the dynamic linker, so that they can be replaced.
//
// Not caught: calls from inside glibc that do not go through the dynamic linker, above all the
// locks of stdio, of malloc, of the linker and of exit handlers, and malloc's own brk and mmap;
// mostly a call that is caught comes first. Waiting that is no function: page faults
// (thread_page_faults()), spinning on an atomic, a system call by inline assembly. And waiting that
// is the program's own business: read, write, poll, nanosleep on purpose pass, since the loop
// sleeps, and sockets and event descriptors that do not block are how it talks to the world. So to
// wake another thread, write to an eventfd or let it look by itself: signalling a condition takes
// its lock.
//
// Free of a null pointer passes: it does nothing. Unlocking passes: it follows a lock.
#ifdef TOPOLOC_RT_TRAPS

#include "topoloc/realtime/forbid_blocking.hpp"

#include "realtime/trap_report.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#error "TOPOLOC_RT_TRAPS and sanitizers replace the same functions: build with one of them"
#endif
#ifndef __GLIBC__
#error "TOPOLOC_RT_TRAPS needs glibc"
#endif

namespace topoloc::realtime::detail {

namespace {

// Initial-exec: part of the thread's own block. The other models may allocate on a thread's first
// look at it, in malloc, for malloc.
[[gnu::tls_model("initial-exec")]] constinit thread_local int depth = 0;

/// Ends the process if the thread must not make that call.
inline void trap(const char* call) {
  if (depth > 0) [[unlikely]] {
    depth = 0;  // the report may do anything
    report_trap(call);
  }
}

/// The function of that name that stands behind ours. Looked up anew by threads that come at once,
/// with the same result: a lock here would be one that we stand before.
void* behind(const char* name, std::atomic<void*>& known) {
  void* function = known.load(std::memory_order_relaxed);
  if (function == nullptr) {
    function = dlsym(RTLD_NEXT, name);
    if (function == nullptr) {
      report_missing(name);
    }
    known.store(function, std::memory_order_relaxed);
  }
  return function;
}

}  // namespace

int forbidden_depth() { return depth; }

int exchange_forbidden_depth(int new_depth) {
  const int before = depth;
  depth = new_depth;
  return before;
}

}  // namespace topoloc::realtime::detail

using topoloc::realtime::detail::behind;
using topoloc::realtime::detail::trap;

extern "C" {

// glibc's own, under the names that it exports for replacements of malloc: dlsym may allocate.
// NOLINTBEGIN(*reserved-identifier)
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* __libc_valloc(std::size_t size);
void* __libc_pvalloc(std::size_t size);
void __libc_free(void* memory);
// NOLINTEND(*reserved-identifier)

void* malloc(std::size_t size) noexcept {
  trap("malloc");
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  trap("calloc");
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
  trap("realloc");
  return __libc_realloc(memory, size);
}

void* reallocarray(void* memory, std::size_t count, std::size_t size) noexcept {
  trap("reallocarray");
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(memory, bytes);
}

void free(void* memory) noexcept {
  if (memory != nullptr) {
    trap("free");
    __libc_free(memory);
  }
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  trap("memalign");
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  trap("aligned_alloc");
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  trap("posix_memalign");
  if (alignment % sizeof(void*) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) {
    return EINVAL;
  }
  const int before = errno;  // posix_memalign leaves it alone
  void* aligned = __libc_memalign(alignment, size);
  errno = before;
  if (aligned == nullptr) {
    return ENOMEM;
  }
  *memory = aligned;
  return 0;
}

void* valloc(std::size_t size) noexcept {
  trap("valloc");
  return __libc_valloc(size);
}

void* pvalloc(std::size_t size) noexcept {
  trap("pvalloc");
  return __libc_pvalloc(size);
}

// Asks first; then the C library's function of that name, as ours is declared.
#define TOPOLOC_BEHIND(name)                                          \
  [] {                                                                \
    trap(#name);                                                      \
    static constinit std::atomic<void*> known{nullptr};               \
    return reinterpret_cast<decltype(&::name)>(behind(#name, known)); \
  }()

void* mmap(void* at, std::size_t size, int access, int flags, int fd, off_t offset) noexcept {
  return TOPOLOC_BEHIND(mmap)(at, size, access, flags, fd, offset);
}

void* mmap64(void* at, std::size_t size, int access, int flags, int fd, off64_t offset) noexcept {
  return TOPOLOC_BEHIND(mmap64)(at, size, access, flags, fd, offset);
}

int munmap(void* at, std::size_t size) noexcept { return TOPOLOC_BEHIND(munmap)(at, size); }

int mprotect(void* at, std::size_t size, int access) noexcept {
  return TOPOLOC_BEHIND(mprotect)(at, size, access);
}

int madvise(void* at, std::size_t size, int advice) noexcept {
  return TOPOLOC_BEHIND(madvise)(at, size, advice);
}

int brk(void* end) noexcept { return TOPOLOC_BEHIND(brk)(end); }

void* sbrk(std::intptr_t increment) noexcept { return TOPOLOC_BEHIND(sbrk)(increment); }

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  return TOPOLOC_BEHIND(pthread_mutex_lock)(mutex);
}

int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  return TOPOLOC_BEHIND(pthread_mutex_trylock)(mutex);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_mutex_timedlock)(mutex, until);
}

int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock,
                            const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_mutex_clocklock)(mutex, clock, until);
}

int pthread_spin_lock(pthread_spinlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_spin_lock)(lock);
}

int pthread_spin_trylock(pthread_spinlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_spin_trylock)(lock);
}

int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_rdlock)(lock);
}

int pthread_rwlock_tryrdlock(pthread_rwlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_tryrdlock)(lock);
}

int pthread_rwlock_timedrdlock(pthread_rwlock_t* lock, const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_timedrdlock)(lock, until);
}

int pthread_rwlock_clockrdlock(pthread_rwlock_t* lock, clockid_t clock,
                               const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_clockrdlock)(lock, clock, until);
}

int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_wrlock)(lock);
}

int pthread_rwlock_trywrlock(pthread_rwlock_t* lock) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_trywrlock)(lock);
}

int pthread_rwlock_timedwrlock(pthread_rwlock_t* lock, const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_timedwrlock)(lock, until);
}

int pthread_rwlock_clockwrlock(pthread_rwlock_t* lock, clockid_t clock,
                               const timespec* until) noexcept {
  return TOPOLOC_BEHIND(pthread_rwlock_clockwrlock)(lock, clock, until);
}

int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  return TOPOLOC_BEHIND(pthread_cond_wait)(condition, mutex);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                           const timespec* until) {
  return TOPOLOC_BEHIND(pthread_cond_timedwait)(condition, mutex, until);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* until) {
  return TOPOLOC_BEHIND(pthread_cond_clockwait)(condition, mutex, clock, until);
}

int pthread_cond_signal(pthread_cond_t* condition) noexcept {
  return TOPOLOC_BEHIND(pthread_cond_signal)(condition);
}

int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
  return TOPOLOC_BEHIND(pthread_cond_broadcast)(condition);
}

int sem_wait(sem_t* semaphore) { return TOPOLOC_BEHIND(sem_wait)(semaphore); }

int sem_trywait(sem_t* semaphore) noexcept { return TOPOLOC_BEHIND(sem_trywait)(semaphore); }

int sem_timedwait(sem_t* semaphore, const timespec* until) {
  return TOPOLOC_BEHIND(sem_timedwait)(semaphore, until);
}

int sem_clockwait(sem_t* semaphore, clockid_t clock, const timespec* until) {
  return TOPOLOC_BEHIND(sem_clockwait)(semaphore, clock, until);
}

int sem_post(sem_t* semaphore) noexcept { return TOPOLOC_BEHIND(sem_post)(semaphore); }

int pthread_join(pthread_t thread, void** result) {
  return TOPOLOC_BEHIND(pthread_join)(thread, result);
}

int pthread_barrier_wait(pthread_barrier_t* barrier) noexcept {
  return TOPOLOC_BEHIND(pthread_barrier_wait)(barrier);
}

// std::atomic::wait and notify, std::counting_semaphore and std::latch reach the kernel by this.
long syscall(long number, ...) noexcept {
  if (number == SYS_futex) {
    trap("futex");
  }
  // As glibc's own, which does not know how many there are either.
  std::array<long, 6> arguments{};
  va_list list;
  va_start(list, number);
  for (long& argument : arguments) {
    argument = va_arg(list, long);
  }
  va_end(list);
  static constinit std::atomic<void*> known{nullptr};
  const auto next = reinterpret_cast<decltype(&::syscall)>(behind("syscall", known));
  return next(number, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4],
              arguments[5]);
}

}  // extern "C"

#endif  // TOPOLOC_RT_TRAPS
