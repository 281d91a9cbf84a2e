// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/lcm_receiver.hpp"

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
    lcm_.subscribe(config.camera.channel, &LcmReceiver::take_image, this);
  }
  if (!config.channels.initial_pose.empty()) {
    lcm_.subscribe(config.channels.initial_pose, &LcmReceiver::take_pose, this);
  }
  if (!config.channels.command.empty()) {
    lcm_.subscribe(config.channels.command, &LcmReceiver::take_command, this);
  }
}

void LcmReceiver::run(const std::atomic<bool>& stop,
                      const std::function<void(const ReceiverStatus&)>& report) {
  constexpr int kTimeout_ms = 50;
  while (!stop.load(std::memory_order_acquire)) {
    if (lcm_.handleTimeout(kTimeout_ms) > 0) {
      report(status_);
    }
  }
}

void LcmReceiver::take_image(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/) {
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
      clock_.from_system(image.time_us * 1000) + config_.camera.kalibr.time_offset_ns;
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

void LcmReceiver::take_pose(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/) {
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
    pose.time_ns = clock_.from_system(message.utime * 1000);
  }
  ++status_.poses;
  status_.poses_lost += ports_.poses.try_push(pose) ? 0 : 1;
}

void LcmReceiver::take_command(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/) {
  command_t message{};
  if (!decode(buffer, message) || message.command != command_t::STOP) {
    ++status_.bad_commands;
    return;
  }
  stop_process_();
}

}  // namespace topoloc::live
