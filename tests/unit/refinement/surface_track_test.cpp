// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/surface_track.hpp"

#include "topoloc/refinement/registration.hpp"

#include "unit/refinement/textured_street.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Two photos of a street, half a metre (or six) apart, and the corners of the first; made once.
class SurfaceTracks : public ::testing::Test {
 protected:
  struct Pair {
    explicit Pair(double way_m) : step_m(way_m) {}

    double step_m;
    TexturedStreet street{5};
    PinholeCamera camera = TexturedStreet::camera();
    RigidTransform T_world_from = TexturedStreet::vehicle_at(3.0) * TexturedStreet::T_imu_cam();
    RigidTransform T_world_to =
        moved(TexturedStreet::vehicle_at(3.0 + step_m),
              (Vector6() << 0.002, 0.004, 0.01, 0.0, 0.05, 0.01).finished()) *
        TexturedStreet::T_imu_cam();
    cv::Mat from = street.photo(T_world_from);
    cv::Mat to = street.photo(T_world_to);
    cv::Mat all{camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(255)};
    mapping::RenderedView view = mapping::render(street.scan(), camera, T_world_from);
    std::vector<SurfacePoint> points = find_surface_points(from, all, view, T_world_from, {}, {});
    [[nodiscard]] RigidTransform T_to_from() const { return T_world_to.inverse() * T_world_from; }
    /// The corners as if the cloud had a surface in front of each, so that the street is seen in
    /// it, or through it, that many times farther away.
    [[nodiscard]] std::vector<SurfacePoint> in_front(double times_farther) const {
      std::vector<SurfacePoint> moved_up = points;
      for (SurfacePoint& point : moved_up) {
        const Eigen::Vector3d back_m = (1.0 / times_farther - 1.0) * point.depth_m *
                                       (T_world_from.R * camera.ray(point.pixel_px));
        point.plane_world(3) += point.plane_world.head<3>().dot(back_m);
        point.depth_m /= times_farther;
      }
      return moved_up;
    }
    [[nodiscard]] FollowedPoints follow(const std::vector<SurfacePoint>& of) const {
      return track(from, of, to, all, T_to_from(), camera, {});
    }
  };
  static const Pair& pair() {
    static const Pair made(0.5);
    return made;
  }
  static std::vector<SurfaceTrack> tracks(const cv::Mat& to_mask, const RigidTransform& T_to_from) {
    return track(pair().from, pair().points, pair().to, to_mask, T_to_from, pair().camera, {})
        .tracks;
  }
  static RigidTransform T_to_from() { return pair().T_to_from(); }
  /// Where a pixel of the first photo is on the street.
  static Eigen::Vector3d on_street(const Eigen::Vector2d& pixel_px) {
    const auto hit = pair().street.meet_ray(pair().T_world_from.p,
                                            pair().T_world_from.R * pair().camera.ray(pixel_px));
    EXPECT_TRUE(hit.has_value());
    return hit.value_or(Eigen::Vector3d::Zero());
  }
  static std::vector<double> misses_px(const std::vector<SurfaceTrack>& found) {
    std::vector<double> misses;
    for (const SurfaceTrack& t : found) {
      const Eigen::Vector3d q = pair().T_world_to.inverse() * on_street(t.from.pixel_px);
      misses.push_back((pair().camera.project(q) - t.to_px).norm());
    }
    return misses;
  }
};

TEST_F(SurfaceTracks, BeginOnTheSurfacesOfTheCloud) {
  ASSERT_GT(pair().points.size(), 80U);
  std::vector<double> off_m;
  std::vector<double> off_rad;
  for (const SurfacePoint& point : pair().points) {
    const Eigen::Vector3d p = on_street(point.pixel_px);
    EXPECT_NEAR(point.plane_world.head<3>().norm(), 1.0, 1e-9);
    EXPECT_GT(point.depth_std_m, 0.0);
    off_m.push_back(std::abs(point.plane_world.head<3>().dot(p) - point.plane_world(3)));
    off_rad.push_back(
        point.plane_world.head<3>().cross(TexturedStreet::plane_at(p).head<3>()).norm());
  }
  EXPECT_LT(median_of(off_m), 0.01);
  EXPECT_LT(median_of(off_rad), 0.05);
}

TEST_F(SurfaceTracks, EndWhereGeometryPutsThem) {
  const std::vector<SurfaceTrack> found = tracks(pair().all, T_to_from());
  ASSERT_GT(found.size(), 50U);
  EXPECT_LT(median_of(misses_px(found)), 0.3);
  for (const SurfaceTrack& t : found) {
    EXPECT_GE(t.std_px, TrackConfig{}.pixel_std_px);
  }
}

TEST_F(SurfaceTracks, DoNotFollowAPredictionThatIsWrong) {
  Vector6 xi;  // camera axes
  xi << 0.004, -0.004, 0.002, 0.05, 0.03, -0.1;
  const std::vector<SurfaceTrack> found = tracks(pair().all, moved(T_to_from(), xi));
  ASSERT_GT(found.size(), 50U);
  EXPECT_LT(median_of(misses_px(found)), 0.3);
}

TEST_F(SurfaceTracks, DoNotEndUnderAMask) {
  cv::Mat mask = pair().all.clone();
  mask(cv::Rect(0, 0, 200, 240)).setTo(0);
  const std::vector<SurfaceTrack> open = tracks(pair().all, T_to_from());
  const std::vector<SurfaceTrack> found = tracks(mask, T_to_from());
  const auto on_left = [](const SurfaceTrack& t) { return t.to_px.x() < 199.0; };
  EXPECT_GT(std::count_if(open.begin(), open.end(), on_left), 10);
  EXPECT_EQ(std::count_if(found.begin(), found.end(), on_left), 0);
  EXPECT_FALSE(found.empty());
  EXPECT_TRUE(tracks(cv::Mat::zeros(pair().all.size(), CV_8UC1), T_to_from()).empty());
}

TEST_F(SurfaceTracks, DoNotBeginUnderAMaskNorWhereTheCloudHasNoSurface) {
  cv::Mat mask = pair().all.clone();
  mask(cv::Rect(0, 0, 200, 240)).setTo(0);
  const auto right =
      find_surface_points(pair().from, mask, pair().view, pair().T_world_from, {}, {});
  ASSERT_FALSE(right.empty());
  for (const SurfacePoint& point : right) {
    EXPECT_GE(point.pixel_px.x(), 200.0);
  }
  mapping::PointCloud one_point;
  one_point.positions_m.emplace_back(-30.0F, 0.0F, 0.0F);
  one_point.intensities.push_back(1.0F);
  const mapping::RenderedView nothing =
      mapping::render(mapping::CloudGrid(std::move(one_point)), pair().camera, pair().T_world_from);
  EXPECT_TRUE(
      find_surface_points(pair().from, pair().all, nothing, pair().T_world_from, {}, {}).empty());
}

// A mirror, a window: its surface is in the cloud, but what the camera sees there is behind it.
TEST_F(SurfaceTracks, AreNotOfWhatIsSeenFarBehindTheSurface) {
  const FollowedPoints followed = pair().follow(pair().in_front(2.5));
  EXPECT_GT(followed.behind, followed.tracks.size());
  for (const SurfaceTrack& t : followed.tracks) {
    const Eigen::Vector3d q = T_to_from() * (t.from.depth_m * pair().camera.ray(t.from.pixel_px));
    EXPECT_LT((pair().camera.project(q) - t.to_px).norm(), 5.0 * t.std_px);
  }
}

// The verdict is to tell a wheel scale that is wrong by a quarter, and a calibration as wrong.
TEST_F(SurfaceTracks, AreKeptWhereTheyMissByWhatACalibrationMayBeWrong) {
  const FollowedPoints right = pair().follow(pair().points);
  EXPECT_EQ(right.behind, 0U);
  EXPECT_GT(pair().follow(pair().in_front(1.25)).tracks.size(), 9 * right.tracks.size() / 10);
}

// How far behind its surface something lies is told by where it is, not by how near one gets to it:
// after 6 m what was 18 m away looks twice as far as what was 12 m away.
TEST_F(SurfaceTracks, LieAsFarBehindTheirSurfaceAfterALongWay) {
  const Pair six_metres(6.0);
  const auto kept = [&](double times_farther) {
    return six_metres.follow(six_metres.in_front(times_farther)).tracks.size();
  };
  const std::size_t all = kept(1.0);
  ASSERT_GT(all, 20U);
  EXPECT_GT(kept(1.4), 3 * all / 4);
  EXPECT_LT(kept(1.65), all / 3);  // what is left is too far to tell
}

TEST_F(SurfaceTracks, AreNoneWithoutPoints) { EXPECT_TRUE(pair().follow({}).tracks.empty()); }

}  // namespace
}  // namespace topoloc::refinement
