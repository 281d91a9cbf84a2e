// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/live/camera_frame.hpp"
#include "topoloc/live/estimator_loop.hpp"
#include "topoloc/live/frame_gate.hpp"
#include "topoloc/live/host_clock.hpp"
#include "topoloc/realtime/mailbox.hpp"
#include "topoloc/transport/image_view.hpp"

#include <array>
#include <cstdint>
#include <functional>

#include <lcm/lcm-cpp.hpp>

namespace topoloc::live {

class StopEvent;

/// What came in over LCM, since the start. Every frame is in one of the counts of `images` or, if
/// that is kOk, of `timing.stamps`, or it is `wrong_size`.
struct ReceiverStatus {
  std::array<std::uint64_t, transport::kImageVerdicts> images{};  ///< by transport::ImageVerdict
  std::uint64_t wrong_size = 0;  ///< not the size of the calibration
  FrameTiming timing;
  std::uint64_t poses = 0;
  std::uint64_t bad_poses = 0;   ///< undecodable, not finite, no rotation, or of another time
  std::uint64_t poses_lost = 0;  ///< more than the estimator took
  std::uint64_t bad_commands = 0;
  std::uint64_t lcm_failed = 0;  ///< times that LCM could not be read
};

/// Takes camera frames, initial poses and commands from LCM, in a thread of its own.
class LcmReceiver {
 public:
  struct Config {
    config::CameraConfig camera;  ///< frames are taken where it is configured
    config::LcmChannels channels;
    std::int64_t max_frame_age_ns = 1'000'000'000;
  };

  /// Subscribes. All references outlive this.
  LcmReceiver(const Config& config, const HostClock& clock, lcm::LCM& lcm,
              realtime::Mailbox<CameraFrame>& frames, EstimatorPorts& ports,
              std::function<void()> stop_process);

  /// Until `stop` is set. `report` is called after each message, in the receiver's thread.
  void run(const StopEvent& stop, const std::function<void(const ReceiverStatus&)>& report);

 private:
  template <void (LcmReceiver::*kTake)(const lcm::ReceiveBuffer*)>
  void subscribe(const std::string& channel);
  void take_image(const lcm::ReceiveBuffer* buffer);
  void take_pose(const lcm::ReceiveBuffer* buffer);
  void take_command(const lcm::ReceiveBuffer* buffer);

  Config config_;
  HostClock clock_;
  lcm::LCM& lcm_;
  realtime::Mailbox<CameraFrame>& frames_;
  EstimatorPorts& ports_;
  std::function<void()> stop_process_;
  FrameGate gate_;
  CameraFrame frame_;
  ReceiverStatus status_;
};

}  // namespace topoloc::live
