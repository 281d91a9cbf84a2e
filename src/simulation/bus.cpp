// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/bus.hpp"

#include "topoloc/can/dbc.hpp"
#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

namespace topoloc::simulation {
namespace {

constexpr std::uint64_t kCounterModulo = 16;

using Values = std::initializer_list<std::pair<std::string, double>>;

class Encoder {
 public:
  Encoder() : dbc_(can::Dbc::parse(dbc_text(), "topoloc_imu_wheel.dbc")) {}

  [[nodiscard]] can::Frame frame(const std::string& message, const Values& values,
                                 std::int64_t time_ns) const {
    can::Frame frame;
    frame.time_ns = time_ns;
    frame.set_interface("can0");
    for (const auto& [signal_name, value] : values) {
      const auto [found, signal] = dbc_.signal(message + "." + signal_name);
      frame.id = found->id;
      frame.length = static_cast<std::uint8_t>(found->length_bytes);
      const std::span<std::uint8_t> payload(frame.data.data(), frame.length);
      if (!can::encode(signal->coding, value, payload)) {
        throw std::runtime_error("the value " + std::to_string(value) + " does not fit signal " +
                                 message + "." + signal_name);
      }
    }
    return frame;
  }

  /// What a receiver reads out of a frame.
  [[nodiscard]] double value(const can::Frame& frame, const std::string& message,
                             const std::string& signal) const {
    return can::decode(dbc_.signal(message + "." + signal).signal->coding, frame.payload()).value();
  }

 private:
  can::Dbc dbc_;
};

/// The three signals of a triad. What rounding to their steps leaves over goes into the next
/// sample, as a sensor has it that counts angle and velocity: their sums stay right to one step.
class TriadFrames {
 public:
  TriadFrames(const Encoder& encoder, std::string message, std::string signal)
      : encoder_(&encoder), message_(std::move(message)), signal_(std::move(signal)) {}

  can::Frame next(const Eigen::Vector3d& sample, double counter, std::int64_t time_ns) {
    const Eigen::Vector3d wanted = sample + left_over_;
    const can::Frame frame = encoder_->frame(message_,
                                             {{signal_ + "_X", wanted.x()},
                                              {signal_ + "_Y", wanted.y()},
                                              {signal_ + "_Z", wanted.z()},
                                              {signal_ + "_COUNTER", counter}},
                                             time_ns);
    left_over_ = wanted - Eigen::Vector3d(encoder_->value(frame, message_, signal_ + "_X"),
                                          encoder_->value(frame, message_, signal_ + "_Y"),
                                          encoder_->value(frame, message_, signal_ + "_Z"));
    return frame;
  }

 private:
  const Encoder* encoder_;
  std::string message_;
  std::string signal_;
  Eigen::Vector3d left_over_ = Eigen::Vector3d::Zero();
};

/// Stamps of the frames of one sample: in their order on the bus, to candump's microsecond.
class Stamps {
 public:
  Stamps(std::int64_t begin_ns, const BusSpec& spec, std::uint64_t key)
      : begin_ns_(begin_ns), spec_(spec), random_(key) {}

  std::pair<std::int64_t, std::int64_t> of(std::int64_t sampled_ns) {
    const double jitter_s = spec_.jitter_s * std::clamp(random_.normal(), -3.0, 3.0);
    const double first_s = jitter_s + random_.uniform(0.0, 0.5 * spec_.max_delay_s);
    const double second_s = first_s + random_.uniform(0.0, 0.5 * spec_.max_delay_s);
    return {stamp(sampled_ns, first_s), stamp(sampled_ns, second_s)};
  }

 private:
  [[nodiscard]] std::int64_t stamp(std::int64_t sampled_ns, double late_s) const {
    return (begin_ns_ + sampled_ns + std::llround(late_s * 1e9) + 500) / 1000 * 1000;
  }

  std::int64_t begin_ns_;
  BusSpec spec_;
  world::Random random_;
};

double direction(const std::array<double, 4>& speeds) {
  double sum = 0.0;
  for (const double speed : speeds) {
    sum += speed;
  }
  return sum == 0.0 ? 0.0 : sum > 0.0 ? 1.0 : 2.0;
}

}  // namespace

std::vector<can::Frame> put_on_bus(std::span<const estimation::ImuSample> imu,
                                   std::span<const WheelSample> wheels, std::int64_t begin_ns,
                                   const BusSpec& spec, std::uint64_t key) {
  const Encoder encoder;
  TriadFrames accel(encoder, "IMU_ACCEL", "ACCEL");
  TriadFrames rate(encoder, "IMU_RATE", "RATE");
  std::vector<can::Frame> frames;
  frames.reserve(2 * (imu.size() + wheels.size()));
  Stamps imu_stamps(begin_ns, spec, world::key(key, {1}));
  std::uint64_t number = 0;
  for (const estimation::ImuSample& sample : imu) {
    const auto [accel_ns, rate_ns] = imu_stamps.of(sample.time_ns);
    const auto counter = static_cast<double>(number++ % kCounterModulo);
    frames.push_back(accel.next(sample.specific_force_mps2, counter, accel_ns));
    frames.push_back(rate.next(sample.angular_rate_radps, counter, rate_ns));
  }
  Stamps wheel_stamps(begin_ns, spec, world::key(key, {2}));
  number = 0;
  for (const WheelSample& sample : wheels) {
    const auto [direction_ns, speeds_ns] = wheel_stamps.of(sample.time_ns);
    const auto counter = static_cast<double>(number++ % kCounterModulo);
    const std::array<double, 4>& v = sample.speeds_mps;
    frames.push_back(encoder.frame("TRAVEL_DIRECTION",
                                   {{"DIRECTION", direction(v)}, {"DIRECTION_COUNTER", counter}},
                                   direction_ns));
    frames.push_back(encoder.frame("WHEEL_SPEEDS",
                                   {{"FRONT_LEFT", std::abs(v[kFrontLeft])},
                                    {"FRONT_RIGHT", std::abs(v[kFrontRight])},
                                    {"REAR_LEFT", std::abs(v[kRearLeft])},
                                    {"REAR_RIGHT", std::abs(v[kRearRight])},
                                    {"SPEED_COUNTER", counter}},
                                   speeds_ns));
  }
  std::stable_sort(frames.begin(), frames.end(),
                   [](const can::Frame& a, const can::Frame& b) { return a.time_ns < b.time_ns; });
  return frames;
}

}  // namespace topoloc::simulation
