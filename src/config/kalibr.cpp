// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/kalibr.hpp"

#include "config/strict_node.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace topoloc::config {
namespace {

/// Kalibr prints 16 digits; files written by hand often have six.
constexpr double kRotationTolerance = 1e-4;

RigidTransform rigid_transform(StrictNode& camera, const char* key) {
  const std::vector<std::vector<double>> rows = camera.require_rows(key, 4, 4);
  Eigen::Matrix4d T;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      T(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
    }
  }
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if ((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() >
          kRotationTolerance ||
      R.determinant() < 0.0) {
    throw camera.error(key, "its rotation part is not a rotation matrix");
  }
  if (T.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) {
    throw camera.error(key, "its last row must be 0 0 0 1");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU() * svd.matrixV().transpose(), T.topRightCorner<3, 1>()};
}

void read_lens(StrictNode& camera, CameraCalibration& calibration) {
  std::string model;
  camera.require("distortion_model", model,
                 std::vector<std::string>{"radtan", "equidistant", "none"});
  std::vector<double> coefficients;
  const Range any{-1e3, 1e3};
  if (model == "radtan") {
    calibration.distortion = Distortion::kRadTan;
    camera.require("distortion_coeffs", coefficients, std::size_t{4}, std::size_t{5}, any);
  } else if (model == "equidistant") {
    calibration.distortion = Distortion::kEquidistant;
    camera.require("distortion_coeffs", coefficients, std::size_t{4}, std::size_t{4}, any);
  } else {
    calibration.distortion = Distortion::kNone;
    camera.read("distortion_coeffs", coefficients, 0, 5, {0.0, 0.0});
  }
  std::copy(coefficients.begin(), coefficients.end(), calibration.coefficients.begin());
}

}  // namespace

KalibrCamera load_kalibr_camera(const std::filesystem::path& file, const std::string& name) {
  StrictNode top = StrictNode::load(file);
  StrictNode camera = top.required_section(name.c_str());
  std::string model;
  camera.require("camera_model", model, std::vector<std::string>{"pinhole"});

  KalibrCamera result;
  PinholeCamera& pinhole = result.calibration.pinhole;
  std::vector<double> size;
  camera.require("resolution", size, std::size_t{2}, std::size_t{2}, Range{16, 16384});
  pinhole.width_px = static_cast<int>(size[0]);
  pinhole.height_px = static_cast<int>(size[1]);
  if (pinhole.width_px != size[0] || pinhole.height_px != size[1]) {
    throw camera.error("resolution", "expected whole numbers");
  }
  std::vector<double> intrinsics;
  camera.require("intrinsics", intrinsics, std::size_t{4}, std::size_t{4}, Range{-1e5, 1e5});
  if (intrinsics[0] <= 0.0 || intrinsics[1] <= 0.0) {
    throw camera.error("intrinsics", "expected fu, fv, pu, pv with positive focal lengths");
  }
  pinhole.fx_px = intrinsics[0];
  pinhole.fy_px = intrinsics[1];
  pinhole.cx_px = intrinsics[2];
  pinhole.cy_px = intrinsics[3];
  read_lens(camera, result.calibration);
  result.T_imu_cam = rigid_transform(camera, "T_cam_imu").inverse();
  double time_shift_s = 0.0;
  camera.read("timeshift_cam_imu", time_shift_s, {-10.0, 10.0});
  result.time_offset_ns = std::llround(time_shift_s * 1e9);
  return result;
}

KalibrImu load_kalibr_imu(const std::filesystem::path& file) {
  StrictNode top = StrictNode::load(file);
  StrictNode imu = top.has("imu0") ? top.section("imu0") : top;
  KalibrImu result;
  estimation::ImuNoise& noise = result.noise;
  imu.require("accelerometer_noise_density", noise.accel_noise_density, positive_up_to(10.0));
  imu.require("accelerometer_random_walk", noise.accel_random_walk, positive_up_to(10.0));
  imu.require("gyroscope_noise_density", noise.gyro_noise_density, positive_up_to(1.0));
  imu.require("gyroscope_random_walk", noise.gyro_random_walk, positive_up_to(1.0));
  imu.require("update_rate", result.update_rate_hz, Range{1.0, 1e4});
  return result;
}

}  // namespace topoloc::config
