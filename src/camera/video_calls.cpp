// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/video_calls.hpp"

#include "topoloc/camera/image_folder.hpp"
#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/system_clock.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace topoloc::camera {
namespace {

class SystemVideoCalls final : public VideoCalls {
 public:
  int open(const std::string& path) override {
    return repeated([&] { return ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
  }

  void close(int descriptor) override { ::close(descriptor); }

  int control(int descriptor, unsigned long request, void* argument) override {
    return repeated([&] { return ::ioctl(descriptor, request, argument); });
  }

  void* map(int descriptor, std::size_t bytes, std::int64_t offset) override {
    void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }

  void unmap(void* memory, std::size_t bytes) override { ::munmap(memory, bytes); }

  int wait(int descriptor, int timeout_ms) override {
    pollfd waiting{.fd = descriptor, .events = POLLIN, .revents = 0};
    const int ready = ::poll(&waiting, 1, timeout_ms);
    if (ready < 0) {
      return errno == EINTR ? 0 : -errno;
    }
    return ready == 0 ? 0 : waiting.revents;
  }

  std::int64_t now_ns() override { return realtime::MonotonicClock::now_ns(); }
  std::int64_t system_ahead_ns() override { return realtime::read_system_ahead().ahead_ns; }
  void sleep_ms(int duration_ms) override {
    realtime::MonotonicClock::sleep_until(now_ns() + std::int64_t{duration_ms} * 1'000'000);
  }

  std::vector<std::string> devices() override {
    std::vector<std::string> found;
    std::error_code error;
    for (std::filesystem::directory_iterator it("/dev", error), end; !error && it != end;
         it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (name.starts_with("video") && name.size() > 5 && name[5] >= '0' && name[5] <= '9') {
        found.push_back(it->path().string());
      }
    }
    std::sort(found.begin(), found.end(), name_precedes);
    return found;
  }

 private:
  template <typename Call>
  static int repeated(const Call& call) {
    int result = 0;
    do {
      result = call();
    } while (result < 0 && errno == EINTR);
    return result < 0 ? -errno : result;
  }
};

}  // namespace

VideoCalls& system_video_calls() {
  static SystemVideoCalls calls;
  return calls;
}

}  // namespace topoloc::camera
