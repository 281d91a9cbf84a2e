// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/camera_log.hpp"

#include "topoloc/simulation/drive_spec.hpp"
#include "topoloc/transport/image_view.hpp"
#include "topoloc/transport/lcm_log.hpp"
#include "topoloc/world/random.hpp"

#include "support/temporary_folder.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::simulation {
namespace {

constexpr std::int64_t kFilmBegin_ns = 1'780'000'000'000'000'000;
constexpr double kFilmRate_hz = 1.0;
constexpr std::uint64_t kFilmKey = 7;

/// A drive of 80 m in which nothing else moves.
struct ShortDrive {
  world::World world = world::make_world({world::Scenario::kHighway, 3, 80.0});
  Road road = road_of(world);
  Ego ego = drive_along(road, {}, 5);
  world::Visit visit{world, {2, 0.3, 0.0}};
  rendering::Raycaster raycaster{world, visit.parked()};
  RigidTransform T_vehicle_cam = nominal_mounting().T_vehicle_cam;
  rendering::CameraSpec camera;
  ShortDrive() {
    camera.calibration = camera_calibration(96);
    camera.rate_hz = kFilmRate_hz;
    camera.samples_per_pixel = 1;
  }
};

struct Frame {
  double stamp_s;  ///< drive time
  cv::Mat image;
};

std::vector<Frame> filmed(ShortDrive& drive, const CameraLogSpec& spec) {
  const topoloc::testing::TemporaryFolder folder;
  film(drive.raycaster, drive.ego, drive.visit, drive.T_vehicle_cam, drive.camera,
       rendering::Light::kDay, spec, kFilmBegin_ns, kFilmKey, folder / "camera.lcm", [](double) {});
  const transport::LcmLogReader log(folder / "camera.lcm");
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < log.size(); ++i) {
    transport::ImageView view;
    EXPECT_EQ(transport::view_image(log.event(i).data, view), transport::ImageVerdict::kOk);
    const cv::Mat jpeg(1, static_cast<int>(view.data.size()), CV_8UC1,
                       const_cast<std::byte*>(view.data.data()));
    frames.push_back({static_cast<double>(view.time_us * 1000 - kFilmBegin_ns) * 1e-9,
                      cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE)});
  }
  return frames;
}

/// Grey values between the frames and what is seen `late_s` after their stamps.
double difference(ShortDrive& drive, const std::vector<Frame>& frames, double late_s) {
  rendering::CameraRenderer renderer(drive.raycaster, drive.camera, rendering::Light::kDay,
                                     world::key(kFilmKey, {1}));
  double sum = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto motion = [&](double since_s) {
      const double time_s = frames[i].stamp_s + late_s + since_s;
      return drive.ego.trajectory.at(time_s).T_world_body * drive.T_vehicle_cam;
    };
    sum += cv::norm(renderer.render(motion, i), frames[i].image, cv::NORM_L1);
  }
  return sum / static_cast<double>(frames.front().image.total() * frames.size());
}

TEST(CameraLog, StampsAreEarlierThanMidExposureByTheTimeShift) {
  ShortDrive drive;
  const CameraLogSpec spec;  // 12.4 ms
  ASSERT_EQ(spec.time_shift_s, drive_spec({}).stated_time_shift_s);
  const auto frames = filmed(drive, spec);
  ASSERT_GT(frames.size(), 8U);
  const double seen_then = difference(drive, frames, spec.time_shift_s);
  EXPECT_LT(1.05 * seen_then, difference(drive, frames, 0.0));
  EXPECT_LT(1.05 * seen_then, difference(drive, frames, 2.0 * spec.time_shift_s));
}

TEST(CameraLog, StampsJitterByWhatIsStated) {
  ShortDrive drive;
  CameraLogSpec spec;
  spec.jitter_s = 0.001;
  const auto frames = filmed(drive, spec);
  std::vector<double> off_s;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    off_s.push_back(frames[i].stamp_s - static_cast<double>(i) / kFilmRate_hz);
  }
  const auto count = static_cast<double>(off_s.size());
  const double mean_s = std::accumulate(off_s.begin(), off_s.end(), 0.0) / count;
  double squares = 0.0;
  for (const double off : off_s) {
    squares += (off - mean_s) * (off - mean_s);
  }
  EXPECT_NEAR(std::sqrt(squares / (count - 1.0)), spec.jitter_s, 0.4 * spec.jitter_s);
}

}  // namespace
}  // namespace topoloc::simulation
