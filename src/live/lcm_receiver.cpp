// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/lcm_receiver.hpp"

#include "live/stop_event.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <topoloc/command_t.hpp>
#include <topoloc/initial_pose_t.hpp>
#include <utility>

namespace topoloc::live {
namespace {

std::span<const std::byte> bytes(const lcm::ReceiveBuffer* buffer) {
  return {static_cast<const std::byte*>(buffer->data), buffer->data_size};
}

/// A stamp within what can be computed with: from 1970 to 2096.
std::int64_t possible_us(std::int64_t utime) {
  constexpr std::int64_t kLast_us = 4'000'000'000'000'000;
  return std::clamp<std::int64_t>(utime, 0, kLast_us);
}

template <typename Message>
bool decode(const lcm::ReceiveBuffer* buffer, Message& message) {
  return message.decode(buffer->data, 0, static_cast<int>(buffer->data_size)) >= 0;
}

}  // namespace

LcmReceiver::LcmReceiver(const Config& config, const HostClock& clock, lcm::LCM& lcm,
                         realtime::Mailbox<CameraFrame>& frames, EstimatorPorts& ports,
                         std::function<void()> stop_process)
    : config_(config),
      clock_(clock),
      lcm_(lcm),
      frames_(frames),
      ports_(ports),
      stop_process_(std::move(stop_process)),
      gate_(config.max_frame_age_ns) {
  if (config.camera.configured()) {
    subscribe<&LcmReceiver::take_image>(config.camera.channel);
  }
  if (!config.channels.initial_pose.empty()) {
    subscribe<&LcmReceiver::take_pose>(config.channels.initial_pose);
  }
  if (!config.channels.command.empty()) {
    subscribe<&LcmReceiver::take_command>(config.channels.command);
  }
}

void LcmReceiver::run(const StopEvent& stop,
                      const std::function<void(const ReceiverStatus&)>& report) {
  constexpr int kLook_ms = 1000;  // at a connection that may be broken
  constexpr int kPause_ms = 20;
  while (!stop.wait(kLook_ms, lcm_.getFileno())) {
    const int handled = lcm_.handleTimeout(0);
    if (handled < 0) {
      ++status_.lcm_failed;
      (void)stop.wait(kPause_ms);
    }
    if (handled != 0) {
      report(status_);
    }
  }
}

// LCM's own subscription of member functions trips GCC's check of virtual tables.
template <void (LcmReceiver::*kTake)(const lcm::ReceiveBuffer*)>
void LcmReceiver::subscribe(const std::string& channel) {
  lcm_.subscribeFunction(
      channel,
      +[](const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/, LcmReceiver* self) {
        (self->*kTake)(buffer);
      },
      this);
}

void LcmReceiver::take_image(const lcm::ReceiveBuffer* buffer) {
  clock_.watch();
  const std::int64_t received_ns = clock_.now_ns();
  transport::ImageView image;
  const transport::ImageVerdict verdict = transport::view_image(bytes(buffer), image);
  ++status_.images[static_cast<std::size_t>(verdict)];
  if (verdict != transport::ImageVerdict::kOk) {
    return;
  }
  const PinholeCamera& camera = config_.camera.kalibr.calibration.pinhole;
  if (image.width_px != camera.width_px || image.height_px != camera.height_px) {
    ++status_.wrong_size;
    return;
  }
  std::int64_t time_ns =
      clock_.from_system(possible_us(image.time_us) * 1000) + config_.camera.kalibr.time_offset_ns;
  const FrameStamp stamp = gate_.add(time_ns, received_ns);
  status_.timing = gate_.timing();
  if (stamp != FrameStamp::kAccepted) {
    return;
  }
  frame_.time_ns = time_ns;
  frame_.received_ns = received_ns;
  const auto message = bytes(buffer);
  frame_.message.assign(message.begin(), message.end());
  frames_.put(frame_);
}

void LcmReceiver::take_pose(const lcm::ReceiveBuffer* buffer) {
  clock_.watch();
  initial_pose_t message{};
  if (!decode(buffer, message)) {
    ++status_.bad_poses;
    return;
  }
  const auto& o = message.orientation;
  const Eigen::Quaterniond q(o[0], o[1], o[2], o[3]);
  GivenPose pose;
  pose.T_world_imu.p = Eigen::Map<const Eigen::Vector3d>(message.position);
  // Rounded numbers are no unit quaternion; anything farther off is none at all.
  constexpr double kUnit = 1e-2;
  if (!(std::abs(q.norm() - 1.0) < kUnit) || !pose.T_world_imu.p.allFinite()) {
    ++status_.bad_poses;
    return;
  }
  pose.T_world_imu.R = q.normalized().toRotationMatrix();
  if (message.utime != 0) {
    // A pose of long ago or of the future is another unit or another clock.
    constexpr std::int64_t kOld_ns = 10'000'000'000;
    constexpr std::int64_t kFuture_ns = 1'000'000'000;
    const std::int64_t age_ns =
        clock_.now_ns() - clock_.from_system(possible_us(message.utime) * 1000);
    if (age_ns > kOld_ns || age_ns < -kFuture_ns) {
      ++status_.bad_poses;
      return;
    }
    pose.time_ns = clock_.now_ns() - age_ns;
  }
  ++status_.poses;
  status_.poses_lost += ports_.poses.try_push(pose) ? 0 : 1;
}

void LcmReceiver::take_command(const lcm::ReceiveBuffer* buffer) {
  command_t message{};
  if (!decode(buffer, message) || message.command != command_t::STOP) {
    ++status_.bad_commands;
    return;
  }
  stop_process_();
}

}  // namespace topoloc::live
