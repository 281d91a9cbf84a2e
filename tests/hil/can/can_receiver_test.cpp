// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
//
// On vcan0 and vcan1: tools/with-vcan runs it.
#include "topoloc/can/can_receiver.hpp"

#include "topoloc/can/can_sender.hpp"

#include "can/raw_socket.hpp"
#include "support/allocation_trap.hpp"

#include <chrono>
#include <cstdlib>
#include <functional>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <string>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace {

int filters_set = 0;  ///< times, by this process

}  // namespace

/// In place of the C library's.
extern "C" int setsockopt(int socket, int level, int name, const void* value,
                          socklen_t size) noexcept {
  filters_set += level == SOL_CAN_RAW && name == CAN_RAW_FILTER ? 1 : 0;
  return static_cast<int>(syscall(SYS_setsockopt, socket, level, name, value, size));
}

namespace topoloc::can {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr auto kPatience = std::chrono::seconds(20);  // far more than any stall of the machine

std::int64_t unix_now_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

void ip_link(const std::string& arguments) {
  ASSERT_EQ(std::system(("PATH=$PATH:/usr/sbin:/sbin ip link " + arguments).c_str()), 0)
      << arguments;
}

Frame numbered(std::uint32_t id, std::uint32_t number) {
  Frame frame;
  frame.id = id;
  frame.length = 4;
  for (unsigned i = 0; i < 4; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(number >> 8 * i);
  }
  return frame;
}

std::uint32_t number_of(const Frame& frame) {
  return frame.data[0] | frame.data[1] << 8U | frame.data[2] << 16U |
         static_cast<std::uint32_t>(frame.data[3]) << 24U;
}

/// Receives every 2 ms until `done` says so of all frames so far, or patience ends.
std::vector<Frame> receive_until(CanReceiver& receiver,
                                 const std::function<bool(const std::vector<Frame>&)>& done) {
  std::vector<Frame> all;
  for (const auto end = steady_clock::now() + kPatience; steady_clock::now() < end;) {
    const auto frames = receiver.receive();
    all.insert(all.end(), frames.begin(), frames.end());
    if (done(all)) {
      break;
    }
    std::this_thread::sleep_for(milliseconds(2));
  }
  return all;
}

std::function<bool(const std::vector<Frame>&)> count_is(std::size_t count) {
  return [count](const std::vector<Frame>& frames) { return frames.size() >= count; };
}

/// The tests leave interfaces as they found them.
class CanReceiverTest : public ::testing::Test {
 protected:
  static std::vector<CanInput> all_of_vcan0() { return {{.device = "vcan0"}}; }
  void TearDown() override {
    for (const std::string device : {"vcan0", "vcan1"}) {
      ip_link("set " + device + " down");
      ip_link("set " + device + " mtu 72");
      ip_link("set " + device + " up");
    }
  }
};

TEST_F(CanReceiverTest, ReceivesThreeThousandFramesAtOneKilohertz) {
  constexpr std::uint32_t kCount = 3000;
  CanReceiver receiver(all_of_vcan0());
  CanSender sender("vcan0");
  std::vector<std::int64_t> sent_ns(kCount);
  std::vector<std::int64_t> returned_ns(kCount);
  std::jthread sending([&] {
    auto next = steady_clock::now();
    for (std::uint32_t i = 0; i < kCount; ++i) {
      std::this_thread::sleep_until(next += milliseconds(1));
      sent_ns[i] = unix_now_ns();
      EXPECT_EQ(sender.send(numbered(0x100, i)), SendVerdict::kSent);
      returned_ns[i] = unix_now_ns();
    }
  });
  const auto frames = receive_until(receiver, count_is(kCount));
  sending.join();

  ASSERT_EQ(frames.size(), kCount);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(number_of(frames[i]), i);
    EXPECT_EQ(frames[i].interface(), "vcan0");
    // The kernel's stamp lies within the call that sent the frame.
    EXPECT_GE(frames[i].time_ns, sent_ns[i]);
    EXPECT_LE(frames[i].time_ns, returned_ns[i]);
  }
  const CanCounters counters = receiver.counters();
  EXPECT_EQ(counters, (CanCounters{.frames = kCount, .capped_reads = counters.capped_reads}));
}

TEST_F(CanReceiverTest, LetsOnlyConfiguredIdsThrough) {
  CanReceiver receiver({{.device = "vcan0", .ids = {{0x123, false}, {0x124, true}}}});
  CanSender sender("vcan0");
  for (const std::uint32_t id : {0x122U, 0x123U, 0x124U, 0x125U}) {
    for (const bool extended : {false, true}) {
      Frame frame = numbered(id, 1);
      frame.extended = extended;
      ASSERT_EQ(sender.send(frame), SendVerdict::kSent);
    }
  }
  const auto frames = receive_until(receiver, count_is(2));
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].id, 0x123U);
  EXPECT_FALSE(frames[0].extended);
  EXPECT_EQ(frames[1].id, 0x124U);
  EXPECT_TRUE(frames[1].extended);
  EXPECT_TRUE(receiver.receive().empty());
}

TEST_F(CanReceiverTest, CarriesEveryKindOfFrame) {
  CanReceiver receiver(all_of_vcan0());
  CanSender sender("vcan0");
  Frame fd = numbered(0x200, 7);
  fd.fd = true;
  fd.fd_flags = 1;
  fd.length = 64;
  fd.data[63] = 0xAB;
  Frame remote;
  remote.id = 0x201;
  remote.kind = FrameKind::kRemote;
  remote.length = 5;
  Frame empty;
  empty.id = 0x1FFF'FFFF;
  empty.extended = true;
  const std::vector<Frame> sent = {fd, remote, empty};
  for (const Frame& frame : sent) {
    ASSERT_EQ(sender.send(frame), SendVerdict::kSent);
  }
  auto received = receive_until(receiver, count_is(sent.size()));
  for (Frame& frame : received) {
    EXPECT_GT(frame.time_ns, 0);
    frame.time_ns = 0;
    frame.interface_name = {};
  }
  EXPECT_EQ(received, sent);
}

TEST_F(CanReceiverTest, CountsWhatTheKernelDropsWhileTheReaderSleeps) {
  constexpr std::uint32_t kCount = 2000;
  CanReceiver receiver(all_of_vcan0(), {.buffer_bytes = 16 * 1024});
  EXPECT_GE(receiver.buffer_bytes(0), 16 * 1024);
  EXPECT_LT(receiver.buffer_bytes(0), 64 * 1024);
  CanSender sender("vcan0");
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(sender.send(numbered(0x100, i)), SendVerdict::kSent);
  }
  auto frames = receive_until(receiver, [&](const auto&) { return receiver.receive().empty(); });
  // The drops are told with the next frame that gets through.
  ASSERT_EQ(sender.send(numbered(0x100, kCount)), SendVerdict::kSent);
  frames = receive_until(receiver, count_is(1));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(number_of(frames[0]), kCount);
  EXPECT_GT(receiver.counters().dropped, kCount / 2);
  EXPECT_EQ(receiver.counters().frames + receiver.counters().dropped, kCount + 1);
}

TEST_F(CanReceiverTest, HandsOutAtMostTheCapAndTheRestLater) {
  CanReceiver receiver(all_of_vcan0(), {.frames_per_call = 10});
  CanSender sender("vcan0");
  for (std::uint32_t i = 0; i < 25; ++i) {
    ASSERT_EQ(sender.send(numbered(0x100, i)), SendVerdict::kSent);
  }
  EXPECT_EQ(receiver.receive().size(), 10U);
  EXPECT_EQ(receiver.receive().size(), 10U);
  EXPECT_EQ(receiver.receive().size(), 5U);
  EXPECT_EQ(receiver.counters().capped_reads, 2U);
}

TEST_F(CanReceiverTest, MergesTwoInterfacesByTime) {
  CanReceiver receiver({{.device = "vcan0", .interface = "imu0"}, {.device = "vcan1"}});
  CanSender imu("vcan0");
  CanSender wheels("vcan1");
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_EQ((i % 3 == 0 ? wheels : imu).send(numbered(0x100, i)), SendVerdict::kSent);
  }
  const auto frames = receive_until(receiver, count_is(100));
  ASSERT_EQ(frames.size(), 100U);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(number_of(frames[i]), i);
    EXPECT_EQ(frames[i].interface(), i % 3 == 0 ? "vcan1" : "imu0");
  }
  EXPECT_EQ(receiver.counters(0).frames, 66U);
  EXPECT_EQ(receiver.counters(1).frames, 34U);
}

TEST_F(CanReceiverTest, SurvivesThatTheInterfaceIsSetDownAndUp) {
  CanReceiver receiver(all_of_vcan0());
  CanSender sender("vcan0");
  ip_link("set vcan0 down");
  receive_until(receiver, [&](const auto&) { return receiver.state(0) == CanState::kDown; });
  EXPECT_EQ(receiver.state(0), CanState::kDown);
  EXPECT_EQ(sender.send(numbered(0x100, 1)), SendVerdict::kDown);
  ip_link("set vcan0 up");
  receive_until(receiver, [&](const auto&) { return receiver.state(0) == CanState::kUp; });
  EXPECT_EQ(sender.send(numbered(0x100, 2)), SendVerdict::kSent);
  const auto frames = receive_until(receiver, count_is(1));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(number_of(frames[0]), 2U);
  EXPECT_EQ(receiver.counters().went_down, 1U);
  EXPECT_EQ(receiver.counters().came_back, 1U);
  EXPECT_EQ(receiver.counters().disappeared, 0U);
}

TEST_F(CanReceiverTest, SurvivesThatTheInterfaceIsDeletedAndMadeAnew) {
  CanReceiver receiver({{.device = "vcan0", .ids = {{0x100, false}}}});
  CanSender sender("vcan0");
  ip_link("del vcan0");
  filters_set = 0;
  receive_until(receiver, [&](const auto&) { return receiver.counters().failed_rebinds > 1; });
  EXPECT_EQ(filters_set, 0);  // the kernel may take its time for that
  EXPECT_EQ(receiver.state(0), CanState::kGone);
  EXPECT_EQ(sender.send(numbered(0x100, 1)), SendVerdict::kGone);
  ip_link("add vcan0 type vcan");
  ip_link("set vcan0 up");
  receive_until(receiver, [&](const auto&) { return receiver.state(0) == CanState::kUp; });
  EXPECT_EQ(sender.send(numbered(0x101, 2)), SendVerdict::kSent);  // the filter is kept
  EXPECT_EQ(sender.send(numbered(0x100, 3)), SendVerdict::kSent);
  const auto frames = receive_until(receiver, count_is(1));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(number_of(frames[0]), 3U);
  EXPECT_EQ(receiver.counters().disappeared, 1U);
  EXPECT_EQ(receiver.counters().came_back, 1U);
}

TEST_F(CanReceiverTest, CountsErrorFramesByKindAndHandsOutNone) {
  CanReceiver receiver({{.device = "vcan0", .ids = {{0x100, false}}}});
  const Descriptor controller(open_raw_socket("vcan0"));
  bind_or_throw(controller.number(), "vcan0");
  const auto report = [&](canid_t error_class, std::uint8_t controller_status) {
    can_frame frame{};
    frame.can_id = CAN_ERR_FLAG | error_class;
    frame.len = CAN_ERR_DLC;
    frame.data[1] = controller_status;
    ASSERT_EQ(::write(controller.number(), &frame, sizeof(frame)), ssize_t{sizeof(frame)});
  };
  report(CAN_ERR_BUSOFF, 0);
  report(CAN_ERR_RESTARTED, 0);
  report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING);
  report(CAN_ERR_CRTL | CAN_ERR_BUSERROR, CAN_ERR_CRTL_TX_PASSIVE);
  report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW);
  report(CAN_ERR_ACK, 0);
  EXPECT_TRUE(receive_until(receiver, [&](const auto&) {
                return receiver.counters().error_frames == 6;
              }).empty());
  EXPECT_EQ(receiver.counters(), (CanCounters{.error_frames = 6,
                                              .bus_off = 1,
                                              .restarted = 1,
                                              .controller_warnings = 2,
                                              .controller_overflows = 1,
                                              .other_errors = 1}));
}

TEST_F(CanReceiverTest, StartsOnAnInterfaceThatIsStillDown) {
  ip_link("set vcan0 down");
  CanReceiver receiver(all_of_vcan0());
  EXPECT_EQ(receiver.state(0), CanState::kDown);
  receiver.receive();
  ip_link("set vcan0 up");
  receive_until(receiver, [&](const auto&) { return receiver.state(0) == CanState::kUp; });
  CanSender sender("vcan0");
  EXPECT_EQ(sender.send(numbered(0x100, 1)), SendVerdict::kSent);
  EXPECT_EQ(receive_until(receiver, count_is(1)).size(), 1U);
  EXPECT_EQ(receiver.counters().went_down, 0U);
}

TEST_F(CanReceiverTest, AllocatesNothingWhileReceiving) {
  if (!testing::AllocationTrap::kAvailable) {
    GTEST_SKIP() << "sanitizers bring their own malloc";
  }
  CanReceiver receiver({{.device = "vcan0"}, {.device = "vcan1"}}, {.rebind_interval_ns = 1});
  CanSender sender("vcan0");
  const auto received_without_allocation = [&] {
    const testing::AllocationTrap trap;
    const std::size_t count = receiver.receive().size();
    EXPECT_EQ(trap.count(), 0U);
    return count;
  };
  for (std::uint32_t i = 0; i < 300; ++i) {
    ASSERT_EQ(sender.send(numbered(0x100, i)), SendVerdict::kSent);
  }
  EXPECT_EQ(received_without_allocation(), 256U);
  EXPECT_EQ(received_without_allocation(), 44U);
  ip_link("del vcan1");
  for (int i = 0; i < 3; ++i) {
    received_without_allocation();
  }
  EXPECT_EQ(receiver.state(1), CanState::kGone);
  ip_link("add vcan1 type vcan");
  ip_link("set vcan1 up");
  for (int i = 0; i < 3; ++i) {
    received_without_allocation();
  }
  EXPECT_EQ(receiver.state(1), CanState::kUp);
}

TEST_F(CanReceiverTest, SaysWhichInterfaceIsMissingAndWhatThereIs) {
  EXPECT_THAT(
      [] { CanReceiver receiver({{.device = "can7"}}); },
      ThrowsMessage<std::runtime_error>(::testing::AllOf(
          HasSubstr("CAN interface 'can7': there is no such interface"),
          HasSubstr("CAN interfaces here: vcan0, vcan1"), HasSubstr("ip link set can7 up"))));
  EXPECT_THAT([] { CanReceiver receiver({{.device = "lo"}}); },
              ThrowsMessage<std::runtime_error>(HasSubstr("'lo': is no CAN interface")));
  EXPECT_THAT([] { CanSender sender("can7"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("there is no such interface")));
}

TEST_F(CanReceiverTest, RefusesCanFdOnAClassicInterface) {
  ip_link("set vcan1 down");
  ip_link("set vcan1 mtu 16");
  ip_link("set vcan1 up");
  CanSender sender("vcan1");
  Frame fd = numbered(0x100, 1);
  fd.fd = true;
  EXPECT_EQ(sender.send(fd), SendVerdict::kNotSupported);
  EXPECT_EQ(sender.send(numbered(0x100, 1)), SendVerdict::kSent);
  ip_link("set vcan1 down");
}

}  // namespace
}  // namespace topoloc::can
