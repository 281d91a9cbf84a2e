// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/map_builder.hpp"

#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"
#include "topoloc/map/maintenance.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/mapping/map_report.hpp"

#include "support/temporary_folder.hpp"
#include "unit/mapping/synthetic_drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class MapBuilderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    config_.threads = 1;
    config_.creator = "test";
    if (!std::filesystem::exists(matching::default_model_dir() / "xfeat_640x384_n512.onnx")) {
      GTEST_SKIP() << "no models in " << matching::default_model_dir();
    }
  }
  static BuildProgress of_nodes(Progress nodes) {
    BuildProgress progress;
    progress.nodes = std::move(nodes);
    return progress;
  }
  /// Bytes of the map of an uninterrupted build.
  [[nodiscard]] std::string built(const BuildConfig& config) const {
    BuildPaths paths = drive_.paths;
    paths.out += ".uninterrupted";
    build_map(paths, config);
    return testing::bytes_of(paths.out);
  }
  /// A build that dies after two of its five nodes.
  void interrupt(const BuildConfig& config) const {
    const auto die = [](double fraction) {
      if (fraction > 0.3) {
        throw std::runtime_error("power cut");
      }
    };
    EXPECT_THAT([&] { build_map(drive_.paths, config, of_nodes(die)); },
                ThrowsMessage<std::runtime_error>(HasSubstr("power cut")));
    EXPECT_FALSE(std::filesystem::exists(drive_.paths.out));
    EXPECT_TRUE(std::filesystem::exists(partial()));
  }
  [[nodiscard]] std::filesystem::path partial() const {
    return drive_.paths.out.string() + ".partial";
  }
  template <typename Matcher>
  void expect_complaint(const Matcher& matcher) const {
    EXPECT_THAT([&] { build_map(drive_.paths, config_); },
                ThrowsMessage<std::runtime_error>(matcher));
    EXPECT_FALSE(std::filesystem::exists(drive_.paths.out));
  }

  SyntheticDrive drive_;
  BuildConfig config_;
};

TEST_F(MapBuilderTest, PutsIntactNodesAtTheSpacing) {
  const BuildReport report = build_map(drive_.paths, config_);
  EXPECT_EQ(report.frames, 21U);
  EXPECT_TRUE(report.frames_rejected.empty());
  EXPECT_EQ(report.nodes_written, 5U);
  EXPECT_EQ(report.nodes_resumed, 0U);
  EXPECT_TRUE(report.rejected_nodes.empty());
  EXPECT_EQ(report.map_bytes, std::filesystem::file_size(drive_.paths.out));
  EXPECT_FALSE(std::filesystem::exists(partial()));

  EXPECT_TRUE(map::verify(drive_.paths.out).ok());
  const map::MapFile map(drive_.paths.out);
  EXPECT_EQ(map.info().creator, "test");
  EXPECT_EQ(map.info().model.name, "xfeat");
  ASSERT_EQ(map.node_count(), 5U);
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    const auto frame = 5 * static_cast<std::int64_t>(i);
    EXPECT_EQ(map.node(i).time_ns,
              (SyntheticDrive::kStart_us + frame * SyntheticDrive::kFrame_us) * 1000);
    EXPECT_LT((map.T_world_cam(i).p - Eigen::Vector3d(static_cast<double>(frame), 0.0, 0.0)).norm(),
              1e-6);
  }
}

TEST_F(MapBuilderTest, PutsFeaturesOnTheSurfacesOfTheCloud) {
  build_map(drive_.paths, config_);
  const map::MapFile map(drive_.paths.out);
  std::size_t lifted = 0;
  std::size_t off = 0;
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    for (const map::FeatureRecord& feature : map.node(i).features) {
      if (!(feature.depth_m > 0.0F)) {
        continue;
      }
      const Eigen::Vector3d point =
          map.T_world_cam(i) * (static_cast<double>(feature.depth_m) *
                                map.info().camera.ray(feature.pixel_px().cast<double>()));
      const double distance_m =
          std::min({std::abs(point.z() - SyntheticDrive::kGround_m),
                    std::abs(std::abs(point.y()) - SyntheticDrive::kHalfWidth_m),
                    std::abs(point.x() - SyntheticDrive::kEnd_m)});
      ++lifted;
      off += distance_m > 0.05 + 3.0 * static_cast<double>(feature.depth_std_m()) ? 1 : 0;
    }
  }
  EXPECT_GT(lifted, map.node_count() * 100U);
  EXPECT_LE(off * 100, lifted) << off << " of " << lifted;
}

TEST_F(MapBuilderTest, KeepsTheIntensityOfTheCloud) {
  build_map(drive_.paths, config_);
  const map::MapFile map(drive_.paths.out);
  ASSERT_TRUE(map.has_intensity_images());
  int width_px = 0;
  int height_px = 0;
  const auto intensity = map::decode_intensity(map.node(0).intensity_image, width_px, height_px);
  const auto depth_m = map::decode_depth(map.node(0).depth_image, width_px, height_px);
  std::array<std::size_t, 256> histogram{};
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    EXPECT_EQ(intensity[i] == 0, depth_m[i] == 0.0F);
    ++histogram[intensity[i]];
  }
  EXPECT_GT(histogram[125], 1000U) << "ground";
  EXPECT_GT(histogram[250], 1000U) << "walls";
  EXPECT_EQ(histogram[0] + histogram[125] + histogram[250], intensity.size());
}

TEST_F(MapBuilderTest, ReportsEveryPlannedNode) {
  auto images = SyntheticDrive::patchwork_images();
  images[5] = SyntheticDrive::jpeg(5, cv::Mat(384, 640, CV_8UC1, cv::Scalar(128)));
  drive_.write_images(images);
  build_map(drive_.paths, config_);
  const map::MapFile map(drive_.paths.out);
  const MapReport report = parse_map_report(map.report());
  EXPECT_EQ(report.creator, "test");
  EXPECT_EQ(report.refine, "none");
  EXPECT_GT(report.cloud_points, 100'000U);
  EXPECT_TRUE(report.cloud_has_intensity);
  ASSERT_EQ(report.nodes.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    const NodeReport& node = report.nodes[i];
    EXPECT_EQ(node.frame, 5 * i);
    EXPECT_EQ(node.time_ns, (SyntheticDrive::kStart_us +
                             static_cast<std::int64_t>(5 * i) * SyntheticDrive::kFrame_us) *
                                1000);
    EXPECT_LT((node.position_m - Eigen::Vector3d(5.0 * static_cast<double>(i), 0, 0)).norm(), 1e-6);
    EXPECT_GT(node.figures.at("coverage"), 0.05);
    EXPECT_EQ(node.rejected.value_or("accepted"), i == 1 ? "too_few_features" : "accepted");
  }
  EXPECT_LT(report.nodes[1].figures.at("features"), 50.0);
  const map::NodeView second = map.node(1);
  EXPECT_EQ(report.nodes[2].figures.at("features"), second.features.size());
  EXPECT_EQ(report.nodes[2].figures.at("lifted"), second.quality.lifted_count);
  EXPECT_NEAR(report.nodes[2].figures.at("mean_depth_std_m"),
              static_cast<double>(second.quality.mean_depth_std_m), 0.01);
}

TEST_F(MapBuilderTest, NumberOfThreadsDoesNotChangeAByte) {
  build_map(drive_.paths, config_);
  config_.threads = 2;
  const std::string other = built(config_);
  ASSERT_FALSE(other.empty());
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == other);
}

TEST_F(MapBuilderTest, MemoryForTheCloudDoesNotChangeAByte) {
  const BuildReport report = build_map(drive_.paths, config_);
  EXPECT_FALSE(report.cloud_on_disk);
  EXPECT_NEAR(report.cloud_spacing_m, 0.07, 1e-3);
  config_.cloud_memory_bytes = 500'000;
  BuildPaths paths = drive_.paths;
  paths.out += ".small";
  EXPECT_TRUE(build_map(paths, config_).cloud_on_disk);
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == testing::bytes_of(paths.out));
  for (const auto& entry : std::filesystem::directory_iterator(paths.out.parent_path())) {
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
  }
}

TEST_F(MapBuilderTest, GoesOnAfterAnInterruptionToTheSameFile) {
  interrupt(config_);
  std::vector<double> fractions;
  const BuildReport report = build_map(
      drive_.paths, config_, of_nodes([&](double fraction) { fractions.push_back(fraction); }));
  EXPECT_EQ(report.nodes_resumed, 2U);
  EXPECT_EQ(report.nodes_written, 5U);
  EXPECT_THAT(fractions, ::testing::ElementsAre(0.6, 0.8, 1.0));
  EXPECT_FALSE(std::filesystem::exists(partial()));
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == built(config_));
}

TEST_F(MapBuilderTest, DoesNotTakeOverNodesOfOtherSettings) {
  interrupt(config_);
  config_.lift.cloud_std_m = 0.06;
  EXPECT_EQ(build_map(drive_.paths, config_).nodes_resumed, 0U);
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == built(config_));
}

TEST_F(MapBuilderTest, DoesNotTakeOverNodesOfAnotherCloud) {
  interrupt(config_);
  drive_.write_cloud(0.01);
  EXPECT_EQ(build_map(drive_.paths, config_).nodes_resumed, 0U);
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == built(config_));
}

/// Says what it is told to.
class ToldPoses : public PoseRefiner {
 public:
  explicit ToldPoses(std::vector<RefinedPose> poses, std::string settings = "told\n")
      : poses_(std::move(poses)), settings_(std::move(settings)) {}
  [[nodiscard]] std::string name() const override { return "told"; }
  [[nodiscard]] std::string settings() const override { return settings_; }
  /// How often it was asked.
  [[nodiscard]] int asked() const { return asked_; }
  std::vector<RefinedPose> refine(const CloudGrid& grid, drive::FrameLog& frames,
                                  const Progress& progress) override {
    ++asked_;
    EXPECT_GT(grid.cloud().size(), 0U);
    EXPECT_EQ(frames.size(), 21U);
    if (progress) {
      progress(1.0);
    }
    return poses_;
  }

 private:
  std::vector<RefinedPose> poses_;
  std::string settings_;
  int asked_ = 0;
};

/// Poses of all frames as the trajectory has them, `off_m` to the side.
std::vector<RefinedPose> beside_the_trajectory(const BuildPaths& paths, double off_m) {
  std::vector<RefinedPose> poses;
  const evaluation::Trajectory trajectory = evaluation::read_tum(paths.trajectory);
  for (std::size_t frame = 0; frame < 21; ++frame) {
    RefinedPose pose;
    pose.frame = frame;
    pose.time_ns = 1000 * (SyntheticDrive::kStart_us +
                           static_cast<std::int64_t>(frame) * SyntheticDrive::kFrame_us);
    pose.T_world_imu = evaluation::pose_at(trajectory, pose.time_ns, 1'000'000'000).value();
    pose.T_world_imu.p.y() += off_m;
    pose.covariance = 0.01 * Eigen::Matrix<double, 6, 6>::Identity();
    pose.figures["pose_std_m"] = 0.1;
    poses.push_back(pose);
  }
  return poses;
}

TEST_F(MapBuilderTest, TakesPosesAndVerdictsOfARefiner) {
  std::vector<RefinedPose> poses = beside_the_trajectory(drive_.paths, 0.2);
  poses[10].rejected = NodeReject::kPoseUncertain;
  ToldPoses refiner(poses);
  const BuildReport report = build_map(drive_.paths, config_, {}, &refiner);
  EXPECT_EQ(report.selection.nodes.size(), 5U);
  const map::MapFile map(drive_.paths.out);
  EXPECT_EQ(map.node_count(), 4U);
  const MapReport map_report = parse_map_report(map.report());
  EXPECT_EQ(map_report.refine, "told");
  ASSERT_EQ(map_report.nodes.size(), 5U);
  EXPECT_EQ(map_report.nodes[2].rejected, "pose_uncertain");
  EXPECT_EQ(map_report.nodes[2].figures.at("pose_std_m"), 0.1);
  EXPECT_NEAR(map_report.nodes[3].position_m.y(), 0.2, 1e-6);
  EXPECT_FALSE(map_report.nodes[3].rejected.has_value());
}

TEST_F(MapBuilderTest, TakesOverRefinedPosesOfAnInterruptedBuild) {
  std::vector<RefinedPose> poses = beside_the_trajectory(drive_.paths, 1.0 / 3.0);
  poses[15].rejected = NodeReject::kPoseContradicted;
  int asked = 0;
  BuildReport report;
  const auto build = [&](const BuildPaths& paths, const std::string& settings,
                         const Progress& nodes = {}) {
    ToldPoses refiner(poses, settings);
    report = {};
    try {
      report = build_map(paths, config_, of_nodes(nodes), &refiner);
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "power cut");
    }
    asked = refiner.asked();
  };
  const auto die = [](double) { throw std::runtime_error("power cut"); };
  build(drive_.paths, "some", die);
  EXPECT_EQ(asked, 1);
  build(drive_.paths, "some");
  EXPECT_EQ(asked, 0);
  EXPECT_TRUE(report.poses_resumed);
  EXPECT_EQ(report.nodes_resumed, 1U);
  EXPECT_EQ(report.nodes_made, 3U);
  EXPECT_FALSE(std::filesystem::exists(partial()));
  BuildPaths other = drive_.paths;
  other.out += ".uninterrupted";
  build(other, "some");
  EXPECT_FALSE(report.poses_resumed);
  EXPECT_TRUE(testing::bytes_of(drive_.paths.out) == testing::bytes_of(other.out));

  // Not with other settings, of another drive, or where they are not wanted.
  build(drive_.paths, "some", die);
  build(drive_.paths, "others", die);
  EXPECT_EQ(asked, 1);
  std::ofstream(drive_.paths.drive / "can.log") << "(1700000000.000000) can0 001#00\n";
  build(drive_.paths, "others", die);
  EXPECT_EQ(asked, 1);
  config_.take_over_poses = false;
  build(drive_.paths, "others");
  EXPECT_EQ(asked, 1);
}

TEST_F(MapBuilderTest, CountsFramesThatRefinementLeftOut) {
  std::vector<RefinedPose> poses = beside_the_trajectory(drive_.paths, 0.0);
  std::erase_if(poses, [](const RefinedPose& pose) { return pose.frame % 4 != 0; });
  ToldPoses refiner(poses);
  config_.selection.frames = FrameParity::kEven;
  const BuildReport report = build_map(drive_.paths, config_, {}, &refiner);
  EXPECT_EQ(report.keyframes, 6U);
  EXPECT_EQ(report.selection.frames_of_other_parity, 10U);
  EXPECT_EQ(report.selection.frames_without_pose, 5U);
}

TEST_F(MapBuilderTest, DoesNotTakeOverNodesOfOtherPoses) {
  const auto build = [&](double off_m, const Progress& nodes = {}) {
    ToldPoses refiner(beside_the_trajectory(drive_.paths, off_m), std::to_string(off_m));
    return build_map(drive_.paths, config_, of_nodes(nodes), &refiner);
  };
  const auto die = [](double share) {
    if (share > 0.3) {
      throw std::runtime_error("power cut");
    }
  };
  EXPECT_THROW(build(0.0, die), std::runtime_error);
  EXPECT_EQ(build(0.001).nodes_resumed, 0U);
  std::filesystem::remove(drive_.paths.out);
  EXPECT_THROW(build(0.0, die), std::runtime_error);
  EXPECT_EQ(build(0.0).nodes_resumed, 2U);
}

TEST_F(MapBuilderTest, LeavesOutFramesThatDoNotMakeANode) {
  auto images = SyntheticDrive::patchwork_images();
  const cv::Mat blank(384, 640, CV_8UC1, cv::Scalar(128));
  images[5] = SyntheticDrive::jpeg(5, blank);
  images[10].data.resize(images[10].data.size() / 2);  // begins as JPEG, then garbage
  std::fill(images[10].data.begin() + 2, images[10].data.end(), std::uint8_t{0});
  images[10].size = static_cast<std::int32_t>(images[10].data.size());
  drive_.write_images(images);
  const BuildReport report = build_map(drive_.paths, config_);
  EXPECT_EQ(report.nodes_written, 3U);
  ASSERT_EQ(report.rejected_nodes.size(), 2U);
  EXPECT_EQ(report.rejected_nodes[0].frame, 5U);
  EXPECT_EQ(report.rejected_nodes[0].reason, NodeReject::kTooFewFeatures);
  EXPECT_EQ(report.rejected_nodes[1].frame, 10U);
  EXPECT_EQ(report.rejected_nodes[1].reason, NodeReject::kUndecodableImage);
  EXPECT_EQ(map::MapFile(drive_.paths.out).node_count(), 3U);
}

TEST_F(MapBuilderTest, NoGoodNodeIsAnError) {
  std::vector<image_t> images;
  for (int frame = 0; frame < SyntheticDrive::kFrames; ++frame) {
    images.push_back(SyntheticDrive::jpeg(frame, cv::Mat(384, 640, CV_8UC1, cv::Scalar(128))));
  }
  drive_.write_images(images);
  expect_complaint(
      AllOf(HasSubstr("map.tmap"), HasSubstr("all 5 nodes"), HasSubstr("too_few_features")));
}

TEST_F(MapBuilderTest, CloudElsewhereIsAnErrorThatNamesBothPlaces) {
  drive_.write_cloud(1000.0);
  expect_complaint(AllOf(HasSubstr("cloud.ply"), HasSubstr("lies elsewhere than the drive"),
                         HasSubstr("Cloud: x 1000.0 to"), HasSubstr("drive: x 0.0 to 20.0")));
  EXPECT_FALSE(std::filesystem::exists(partial()));
}

TEST_F(MapBuilderTest, TrajectoryOfAnotherTimeIsAnErrorThatNamesBothTimes) {
  drive_.write_trajectory(SyntheticDrive::kStart_us + 3'600'000'000);
  expect_complaint(AllOf(HasSubstr("poses.tum"), HasSubstr("gives no pose to any of the frames"),
                         HasSubstr("1700003600 to 1700003602"),
                         HasSubstr("1700000000 to 1700000002")));
}

TEST_F(MapBuilderTest, NamesTheLineOfAPoseThatIsNotANumber) {
  std::ofstream(drive_.paths.trajectory) << "1700000000.0 0 0 0 0 0 0 1\n"
                                         << "1700000001.0 nan 0 0 0 0 0 1\n";
  expect_complaint(AllOf(HasSubstr("poses.tum:2"), HasSubstr("finite")));
}

TEST_F(MapBuilderTest, DriveWithoutFramesIsAnError) {
  drive_.write_images({});
  expect_complaint(HasSubstr("camera.lcm"));
  std::filesystem::remove(drive_.paths.drive / "camera.lcm");
  expect_complaint(HasSubstr("camera.lcm"));
}

TEST_F(MapBuilderTest, ImagesOfAnotherSizeAreAnError) {
  drive_.write_images(
      std::vector{SyntheticDrive::jpeg(0, cv::Mat(32, 64, CV_8UC1, cv::Scalar(128)))});
  expect_complaint(AllOf(HasSubstr("camera.lcm"), HasSubstr("no usable image")));
}

TEST_F(MapBuilderTest, CloudWithoutPointsIsAnError) {
  std::ofstream(drive_.paths.cloud) << "ply\nformat ascii 1.0\nelement vertex 0\n"
                                       "property float x\nproperty float y\nproperty float z\n"
                                       "end_header\n";
  expect_complaint(AllOf(HasSubstr("cloud.ply"), HasSubstr("holds no point")));
}

TEST_F(MapBuilderTest, SaysBeforeTheWorkThatTheMapCannotBeWritten) {
  BuildPaths paths = drive_.paths;
  paths.out = drive_.paths.drive / "nowhere" / "map.tmap";
  EXPECT_THAT([&] { build_map(paths, config_); },
              ThrowsMessage<std::runtime_error>(HasSubstr("its folder does not exist")));
  paths.out = drive_.paths.drive;
  EXPECT_THAT([&] { build_map(paths, config_); },
              ThrowsMessage<std::runtime_error>(HasSubstr("is a folder, not a map file")));
}

}  // namespace
}  // namespace topoloc::mapping
