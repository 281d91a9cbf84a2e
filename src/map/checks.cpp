// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "map/checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <nlohmann/json.hpp>

namespace topoloc::map {
namespace {

constexpr std::size_t kMaxStringLength = 4096;

/// Control characters would reach the terminal of whoever inspects the map.
bool is_text(const std::string& s) {
  return s.size() <= kMaxStringLength &&
         std::none_of(s.begin(), s.end(), [](char c) { return (c >= 0 && c < 0x20) || c == 0x7f; });
}

bool begins_with(std::span<const std::byte> bytes, std::span<const unsigned char> prefix) {
  return bytes.size() >= prefix.size() &&
         std::equal(prefix.begin(), prefix.end(), bytes.begin(), [](unsigned char a, std::byte b) {
           return a == std::to_integer<unsigned char>(b);
         });
}

}  // namespace

bool is_rotation(const Eigen::Matrix3d& R) {
  return R.allFinite() &&
         (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 1e-6 &&
         R.determinant() > 0.0;
}

bool is_position(const Eigen::Vector3d& p_m) {
  return p_m.allFinite() && p_m.cwiseAbs().maxCoeff() <= kMaxCoordinate_m;
}

bool is_covariance(const Eigen::Matrix<double, 6, 6>& covariance) {
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0.0) {
    return false;
  }
  // Radians and metres differ by orders of magnitude: judge the correlations.
  Eigen::Matrix<double, 6, 6> correlation = covariance;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double std = std::sqrt(covariance(i, i));
    if (std == 0.0) {
      if (!covariance.row(i).isZero(0.0) || !covariance.col(i).isZero(0.0)) {
        return false;
      }
      correlation(i, i) = 1.0;
      continue;
    }
    correlation.row(i) /= std;
    correlation.col(i) /= std;
  }
  constexpr double kTolerance = 1e-5;
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > kTolerance) {
    return false;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(correlation,
                                                                          Eigen::EigenvaluesOnly);
  return solver.info() == Eigen::Success && solver.eigenvalues().minCoeff() >= -kTolerance;
}

std::string problem_with(const MapInfo& info) {
  const PinholeCamera& c = info.camera;
  std::ostringstream what;
  if (c.width_px < 1 || c.height_px < 1 || c.width_px > kMaxImageSide_px ||
      c.height_px > kMaxImageSide_px) {
    what << "camera of " << c.width_px << " x " << c.height_px << " px, expected 1 to "
         << kMaxImageSide_px << " each way";
  } else if (!(std::isfinite(c.fx_px) && std::isfinite(c.fy_px) && c.fx_px > 0.0 && c.fy_px > 0.0 &&
               std::isfinite(c.cx_px) && std::isfinite(c.cy_px))) {
    what << "camera intrinsics " << c.fx_px << " " << c.fy_px << " " << c.cx_px << " " << c.cy_px
         << ", expected finite ones with positive focal lengths";
  } else if (!is_rotation(info.T_imu_cam.R) || !is_position(info.T_imu_cam.p)) {
    what << "T_imu_cam is not a finite rigid transform";
  } else if (info.model.descriptor_dim < 1 || info.model.descriptor_dim > kMaxDescriptorDim) {
    what << "descriptors of " << info.model.descriptor_dim << " dimensions, expected 1 to "
         << kMaxDescriptorDim;
  } else if (info.model.name.empty()) {
    what << "the model has no name";
  } else if (!info.origin_m.allFinite()) {
    what << "the origin is not finite";
  } else if (!is_text(info.model.name) || !is_text(info.crs) || !is_text(info.creator)) {
    what << "model name, CRS or creator holds control characters or more than " << kMaxStringLength
         << " characters";
  }
  return what.str();
}

std::string problem_with(const Feature& feature, const PinholeCamera& camera) {
  std::ostringstream what;
  if (!feature.pixel_px.allFinite() || !camera.contains(feature.pixel_px.cast<double>())) {
    what << "pixel (" << feature.pixel_px.x() << ", " << feature.pixel_px.y()
         << ") is outside the image of " << camera.width_px << " x " << camera.height_px;
  } else if (!std::isfinite(feature.depth_m) || feature.depth_m < 0.0F) {
    what << "depth of " << feature.depth_m << " m, expected 0 (not lifted) or a positive one";
  } else if (!std::isfinite(feature.depth_std_m) || feature.depth_std_m < 0.0F) {
    what << "depth deviation of " << feature.depth_std_m << " m, expected 0 or a positive one";
  } else if (!std::isfinite(feature.score)) {
    what << "score " << feature.score;
  }
  return what.str();
}

std::string problem_with(const FeatureRecord& record, const PinholeCamera& camera) {
  Feature feature;
  feature.pixel_px = record.pixel_px();
  feature.depth_m = record.depth_m;
  return problem_with(feature, camera);
}

std::string problem_with_camera_image(std::span<const std::byte> image) {
  constexpr std::array<unsigned char, 3> kJpeg{0xff, 0xd8, 0xff};
  constexpr std::array<unsigned char, 4> kPng{0x89, 'P', 'N', 'G'};
  if (image.empty() || begins_with(image, kJpeg) || begins_with(image, kPng)) {
    return {};
  }
  return "camera image is neither JPEG nor PNG";
}

std::string problem_with_image(const ZstdImageKind& kind, std::span<const std::byte> image,
                               const PinholeCamera& camera) {
  if (image.empty()) {
    return {};
  }
  try {
    const ZstdImageHeader header = read_header(kind, image);
    if (static_cast<int>(header.width_px) != camera.width_px ||
        static_cast<int>(header.height_px) != camera.height_px) {
      return std::string(kind.name) + " of " + std::to_string(header.width_px) + " x " +
             std::to_string(header.height_px) + " px, expected the camera's " +
             std::to_string(camera.width_px) + " x " + std::to_string(camera.height_px);
    }
  } catch (const MapError& error) {
    return error.what();
  }
  return {};
}

std::string problem_with_report(std::string_view report) {
  if (report.size() > kMaxReportSize) {
    return "build report of " + std::to_string(report.size()) + " bytes, at most " +
           std::to_string(kMaxReportSize);
  }
  return report.empty() || nlohmann::json::accept(report) ? ""
                                                          : "build report is not JSON in UTF-8";
}

}  // namespace topoloc::map
