// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/signal_coding.hpp"
#include "topoloc/geometry/camera.hpp"
#include "topoloc/transport/image_view.hpp"
#include "topoloc/transport/lcm_log.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <topoloc/image_t.hpp>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::testing {

/// What one row of a made-up CAN log says: an inertial sample and, perhaps, a wheel speed.
struct CanRow {
  std::int64_t time_us = 0;
  Eigen::Vector3d specific_force_mps2{0.0, 0.0, 9.81};
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();
  std::optional<double> speed_mps = std::nullopt;  ///< of all wheels; negative: reverse
};

/// For drives whose images show nothing.
inline PinholeCamera tiny_camera() {
  return {
      .width_px = 64, .height_px = 32, .fx_px = 50.0, .fy_px = 50.0, .cx_px = 32.0, .cy_px = 16.0};
}

inline image_t jpeg_image(std::int64_t time_us, const cv::Mat& grey) {
  image_t image{};
  image.utime = time_us;
  image.width = static_cast<std::int16_t>(grey.cols);
  image.height = static_cast<std::int16_t>(grey.rows);
  image.pixelformat = transport::kPixelFormatMjpeg;
  cv::imencode(".jpg", grey, image.data);
  image.size = static_cast<std::int32_t>(image.data.size());
  return image;
}

/// A drive folder (docs/drive-folder.md) with the shipped DBC and an undistorted camera that looks
/// ahead from where the IMU is. Its logs are written by the test.
class DriveFolder {
 public:
  /// Makes the folder with vehicle.yaml and what it names.
  DriveFolder(std::filesystem::path dir, const PinholeCamera& camera, double timeshift_s = 0.0)
      : dir_(std::move(dir)) {
    std::filesystem::create_directories(dir_);
    std::filesystem::copy_file(
        std::filesystem::path(TOPOLOC_SOURCE_DIR) / "config" / "topoloc_imu_wheel.dbc",
        dir_ / "topoloc_imu_wheel.dbc");
    write("vehicle.yaml", kVehicle);
    write("imu.yaml", R"(accelerometer_noise_density: 0.01
accelerometer_random_walk: 0.0002
gyroscope_noise_density: 0.005
gyroscope_random_walk: 4.0e-06
update_rate: 100.0
)");
    const auto list = [](std::initializer_list<double> values) {
      std::string text;
      for (const double value : values) {
        text += (text.empty() ? "[" : ", ") + std::to_string(value);
      }
      return text + "]";
    };
    write("camchain.yaml",
          "cam0:\n  camera_model: pinhole\n  intrinsics: " +
              list({camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px}) +
              "\n  distortion_model: none\n  resolution: [" + std::to_string(camera.width_px) +
              ", " + std::to_string(camera.height_px) +
              "]\n  T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]\n"
              "  timeshift_cam_imu: " +
              std::to_string(timeshift_s) + "\n");
  }

  [[nodiscard]] const std::filesystem::path& dir() const { return dir_; }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return dir_ / name;
  }

  void write(const std::string& name, std::string_view text) const {
    std::ofstream(dir_ / name, std::ios::binary) << text;
  }
  /// vehicle.yaml with more sections at its end.
  void write_vehicle_with(std::string_view sections) const {
    write("vehicle.yaml", std::string(kVehicle) + std::string(sections));
  }

  void write_images(std::span<const image_t> images) const {
    transport::LcmLogWriter log(dir_ / "camera.lcm");
    for (const image_t& image : images) {
      std::vector<std::byte> bytes(static_cast<std::size_t>(image.getEncodedSize()));
      image.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      log.write(image.utime, "CAMERA", bytes);
    }
    log.close();
  }

  void write_can_log(std::span<const CanRow> rows) const {
    std::ofstream log(dir_ / "can.log");
    unsigned counter = 0;
    for (const CanRow& row : rows) {
      log << frame(row.time_us, 0x100, vector(row.specific_force_mps2, 0.0002, counter))
          << frame(row.time_us, 0x101, vector(row.angular_rate_radps, 0.00002, counter));
      if (row.speed_mps) {
        log << frame(row.time_us, 0x103,
                     Payload{static_cast<std::uint8_t>(*row.speed_mps < 0.0 ? 2 : 1)})
            << frame(row.time_us, 0x102, wheels(std::abs(*row.speed_mps)));
      }
      counter = (counter + 1) % 16;
    }
  }

 private:
  static constexpr std::string_view kVehicle = R"(format: 1
can:
  dbc: topoloc_imu_wheel.dbc
  imu:
    acceleration: [IMU_ACCEL.ACCEL_X, IMU_ACCEL.ACCEL_Y, IMU_ACCEL.ACCEL_Z]
    angular_rate: [IMU_RATE.RATE_X, IMU_RATE.RATE_Y, IMU_RATE.RATE_Z]
    counters: [IMU_ACCEL.ACCEL_COUNTER, IMU_RATE.RATE_COUNTER]
  wheels:
    speeds: [WHEEL_SPEEDS.FRONT_LEFT, WHEEL_SPEEDS.REAR_RIGHT]
  direction: {signal: TRAVEL_DIRECTION.DIRECTION, reverse_values: [REVERSE]}
camera: {calibration: camchain.yaml}
imu: {calibration: imu.yaml}
)";
  using Payload = std::vector<std::uint8_t>;

  static void put(can::SignalCoding coding, double value, Payload& payload) {
    if (!can::encode(coding, value, payload)) {
      throw std::invalid_argument("does not fit its CAN signal: " + std::to_string(value));
    }
  }
  static Payload vector(const Eigen::Vector3d& v, double scale, unsigned counter) {
    Payload payload(8);
    for (int i = 0; i < 3; ++i) {
      put({.start_bit = static_cast<std::uint16_t>(20 * i),
           .length_bits = 20,
           .value_type = can::ValueType::kSigned,
           .scale = scale},
          v[i], payload);
    }
    put({.start_bit = 60, .length_bits = 4}, counter, payload);
    return payload;
  }
  static Payload wheels(double speed_mps) {
    Payload payload(8);
    for (int i = 0; i < 4; ++i) {
      put({.start_bit = static_cast<std::uint16_t>(15 * i), .length_bits = 15, .scale = 0.002},
          speed_mps, payload);
    }
    return payload;
  }
  /// A line of candump -L.
  static std::string frame(std::int64_t time_us, unsigned id, const Payload& payload) {
    std::array<char, 64> head{};
    std::snprintf(head.data(), head.size(), "(%lld.%06lld) can0 %03X#",
                  static_cast<long long>(time_us / 1'000'000),
                  static_cast<long long>(time_us % 1'000'000), id);
    std::string line = head.data();
    for (const std::uint8_t byte : payload) {
      std::snprintf(head.data(), head.size(), "%02X", byte);
      line += head.data();
    }
    return line + "\n";
  }

  std::filesystem::path dir_;
};

}  // namespace topoloc::testing
