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

using Values = std::initializer_list<std::pair<const char*, double>>;

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

 private:
  can::Dbc dbc_;
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
  std::vector<can::Frame> frames;
  frames.reserve(2 * (imu.size() + wheels.size()));
  Stamps imu_stamps(begin_ns, spec, world::key(key, {1}));
  std::uint64_t number = 0;
  for (const estimation::ImuSample& sample : imu) {
    const auto [accel_ns, rate_ns] = imu_stamps.of(sample.time_ns);
    const auto counter = static_cast<double>(number++ % kCounterModulo);
    const Eigen::Vector3d& a = sample.specific_force_mps2;
    const Eigen::Vector3d& w = sample.angular_rate_radps;
    frames.push_back(encoder.frame(
        "IMU_ACCEL",
        {{"ACCEL_X", a.x()}, {"ACCEL_Y", a.y()}, {"ACCEL_Z", a.z()}, {"ACCEL_COUNTER", counter}},
        accel_ns));
    frames.push_back(encoder.frame(
        "IMU_RATE",
        {{"RATE_X", w.x()}, {"RATE_Y", w.y()}, {"RATE_Z", w.z()}, {"RATE_COUNTER", counter}},
        rate_ns));
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
