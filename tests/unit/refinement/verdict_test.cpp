// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/verdict.hpp"

#include "unit/refinement/graph_drive.hpp"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

using mapping::NodeReject;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A drive of 40 m that fits its cloud, with a registration every 8 m. Tests spoil it.
class Verdict : public ::testing::Test {
 protected:
  static constexpr std::size_t kKeyframes = 41;

  Verdict() {
    for (std::size_t k = 0; k < kKeyframes; ++k) {
      Keyframe keyframe;
      keyframe.frame = 3 * k;
      keyframe.time_ns = 1'000'000'000 + 250'000'000 * static_cast<std::int64_t>(k);
      keyframe.T_odometry = drive_.truth[k];
      keyframes_.push_back(keyframe);
    }
    graph_ = drive_.with_odometry();
    for (std::size_t k = 0; k < kKeyframes; k += 8) {
      graph_.registrations.push_back(drive_.registration(k, 0.003, 0.05));
    }
  }

  [[nodiscard]] std::vector<mapping::RefinedPose> judged() const {
    const PinholeCamera camera = TexturedStreet::camera();
    const RigidTransform T_imu_cam = TexturedStreet::T_imu_cam();
    return judge({keyframes_, drive_.truth, graph_, stretches_tried_, graph_.registrations.size(),
                  lens_, T_imu_cam, camera},
                 {});
  }
  [[nodiscard]] std::string complaint() const {
    try {
      (void)judged();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    ADD_FAILURE() << "no complaint";
    return "";
  }
  /// Poses known beforehand of the first `count` keyframes, `off` (theta, t) from the truth.
  void give_trajectory(const Vector6& off, std::size_t count) {
    graph_.priors.clear();
    for (std::size_t k = 0; k < count; ++k) {
      graph_.priors.push_back({k, moved(drive_.truth[k], off), both(1.0, 1.0)});
    }
  }
  /// Leaves only registrations up to a keyframe.
  void forget_registrations_after(std::size_t keyframe) {
    std::erase_if(graph_.registrations,
                  [&](const Registration& r) { return r.keyframe > keyframe; });
    stretches_tried_ = graph_.registrations.size();
  }

  GraphDrive drive_{kKeyframes};
  std::vector<Keyframe> keyframes_;
  PoseGraph graph_;
  std::size_t stretches_tried_ = 6;
  BestLens lens_;
};

TEST_F(Verdict, AcceptsADriveThatFits) {
  const auto poses = judged();
  ASSERT_EQ(poses.size(), kKeyframes);
  const double floor_m = RefinementConfig{}.floor_std(3);
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    EXPECT_FALSE(poses[k].rejected.has_value()) << k;
    EXPECT_EQ(poses[k].frame, 3 * k);
    EXPECT_EQ(poses[k].time_ns, keyframes_[k].time_ns);
    EXPECT_EQ(poses[k].T_world_imu.p, drive_.truth[k].p);
    const double std_m = std::sqrt(poses[k].covariance.diagonal().tail<3>().maxCoeff());
    EXPECT_GT(std_m, floor_m);
    EXPECT_EQ(poses[k].figures.at("pose_std_m"), std_m);
    EXPECT_LE(poses[k].figures.at("registration_away_m"), 4.01);
    EXPECT_EQ(poses[k].figures.at("registration_significance"), 10.0);
    EXPECT_EQ(poses[k].figures.count("moved_m"), 0U);
  }
}

TEST_F(Verdict, TellsHowFarAPoseWasMoved) {
  keyframes_[2].T_prior = drive_.truth[2];
  keyframes_[2].T_prior->p += Eigen::Vector3d(0.3, 0.0, 0.4);
  EXPECT_NEAR(judged()[2].figures.at("moved_m"), 0.5, 1e-9);
}

TEST_F(Verdict, RejectsWhatNoRegistrationIsNear) {
  forget_registrations_after(8);
  const auto poses = judged();
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    if (k > 33) {
      EXPECT_EQ(poses[k].rejected, NodeReject::kPoseUnsupported) << k;
      EXPECT_GT(poses[k].figures.at("registration_away_m"), 25.0) << k;
    } else if (k < 33) {
      EXPECT_FALSE(poses[k].rejected.has_value()) << k;
    }
  }
}

TEST_F(Verdict, RejectsWhatIsUncertainInPlace) {
  forget_registrations_after(16);
  graph_.odometry[20].std.tail<3>().setConstant(0.5);  // the wheels slipped: from 20 to 21
  const auto poses = judged();
  EXPECT_FALSE(poses[20].rejected.has_value());
  EXPECT_EQ(poses[21].rejected, NodeReject::kPoseUncertain);
  EXPECT_EQ(poses[28].rejected, NodeReject::kPoseUncertain);
  EXPECT_GT(poses[21].figures.at("pose_std_m"), 0.25);
}

TEST_F(Verdict, RejectsWhatIsUncertainInDirection) {
  forget_registrations_after(16);
  graph_.odometry[20].std.head<3>().setConstant(0.05);
  const auto poses = judged();
  EXPECT_FALSE(poses[20].rejected.has_value());
  EXPECT_EQ(poses[21].rejected, NodeReject::kPoseUncertain);
  EXPECT_LT(poses[21].figures.at("pose_std_m"), 0.25);
}

TEST_F(Verdict, RejectsWhatItsRegistrationContradicts) {
  graph_.registrations[2].T_world_imu.p.y() += 0.5;  // of keyframe 16
  const auto poses = judged();
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    if (k > 12 && k < 20) {
      EXPECT_EQ(poses[k].rejected, NodeReject::kPoseContradicted) << k;
      EXPECT_NEAR(poses[k].figures.at("registration_residual_m"), 0.5, 1e-9) << k;
    } else if (k < 12 || k > 20) {
      EXPECT_FALSE(poses[k].rejected.has_value()) << k;
    }
  }
}

TEST_F(Verdict, AllowsToARegistrationWhatItIsUncertainBy) {
  graph_.registrations[2].T_world_imu.p.y() += 0.5;  // of keyframe 16
  graph_.registrations[2].covariance = both(0.02, 0.3).cwiseAbs2().asDiagonal();
  EXPECT_FALSE(judged()[16].rejected.has_value());
}

TEST_F(Verdict, RefusesADriveOfWhichTooLittleWasRegistered) {
  stretches_tried_ = 16;  // 6 of them: under 40 %
  EXPECT_THAT(complaint(), AllOf(HasSubstr("of 16 stretches"), HasSubstr("only 6"),
                                 HasSubstr("cloud of this place"), HasSubstr("intensities"),
                                 HasSubstr("calibration"), HasSubstr("time offset")));
  stretches_tried_ = 15;
  EXPECT_NO_THROW((void)judged());
}

TEST_F(Verdict, RefusesADriveTooShortForAnyWindow) {
  graph_.registrations.clear();
  stretches_tried_ = 0;
  EXPECT_THAT(complaint(), AllOf(HasSubstr("too short"), HasSubstr("41 frames")));
}

TEST_F(Verdict, SaysNothingOfTracksWhereThereAreNone) {
  EXPECT_FALSE(judged()[5].figures.contains("track_residual_px"));
  EXPECT_FALSE(judged()[5].figures.contains("behind"));
}

TEST_F(Verdict, RefusesADriveThatAnotherLensFitsBetter) {
  lens_ = {{1.04, 0.0}, 1.05, 2.0};  // may be chance
  EXPECT_NO_THROW((void)judged());
  lens_ = {{0.92, 0.0}, 1.3, 3.0};
  EXPECT_THAT(complaint(), AllOf(HasSubstr("30 %"), HasSubstr("0.92"), HasSubstr("focal length"),
                                 HasSubstr("intrinsics")));
  lens_ = {{1.0, -0.2}, 1.2, 9.0};
  EXPECT_THAT(complaint(), AllOf(HasSubstr("20 %"), HasSubstr("-0.2 added"),
                                 HasSubstr("distortion"), HasSubstr("intrinsics")));
}

TEST_F(Verdict, RefusesADriveThatLiesBesideItsTrajectory) {
  for (const int axis : {3, 4, 5}) {
    // 3.4 deviations are the limit.
    give_trajectory(0.9 * Vector6::Unit(axis), kKeyframes);
    EXPECT_NO_THROW((void)judged());
    give_trajectory(1.1 * Vector6::Unit(axis), kKeyframes);
    EXPECT_THAT(complaint(), AllOf(HasSubstr("1.10 m and 0.0 degrees from"), HasSubstr("0.30 m"),
                                   HasSubstr("extrinsics"), HasSubstr("--trajectory-std-m")));
  }
}

TEST_F(Verdict, RefusesADriveThatIsTurnedAgainstItsTrajectory) {
  give_trajectory(0.05 * Vector6::Unit(2), kKeyframes);
  EXPECT_NO_THROW((void)judged());
  give_trajectory(0.07 * Vector6::Unit(2), kKeyframes);
  EXPECT_THAT(complaint(), HasSubstr("4.0 degrees from"));
}

TEST_F(Verdict, RefusesADriveThatLiesBesideItsInitialPose) {
  give_trajectory(1.1 * Vector6::Unit(4), 1);
  EXPECT_THAT(complaint(), HasSubstr("1.10 m and"));
}

TEST_F(Verdict, DoesNotAskPosesFarFromAnyRegistrationWhereTheDriveLies) {
  give_trajectory(1.1 * Vector6::Unit(4), kKeyframes);
  graph_.priors.erase(graph_.priors.begin(), graph_.priors.begin() + 36);
  forget_registrations_after(8);
  EXPECT_NO_THROW((void)judged());
}

TEST_F(Verdict, RefusesADriveWhoseTracksMiss) {
  graph_.tracks = drive_.tracks({1});
  EXPECT_NO_THROW((void)judged());
  for (TrackFactor& factor : graph_.tracks) {
    for (SurfaceTrack& track : factor.tracks) {
      track.to_px.x() += 4.2;
    }
  }
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("4.2 px"), HasSubstr("at most 4.0 px"), HasSubstr("intrinsics"),
                    HasSubstr("extrinsics"), HasSubstr("time offset"), HasSubstr("wheel scale")));
}

// Wheels that tell 1.6 times the way make everything look 1.6 times as far: too far to be a track.
TEST_F(Verdict, RefusesADriveMostOfWhosePointsLieFarBehindTheirSurface) {
  graph_.tracks = drive_.tracks({1});
  const auto leave_out = [&](double share) {
    for (TrackFactor& factor : graph_.tracks) {
      const std::size_t all = factor.tracks.size() + factor.behind;
      factor.behind = static_cast<std::size_t>(std::ceil(share * static_cast<double>(all)));
      factor.tracks.resize(all - factor.behind);
    }
  };
  EXPECT_EQ(judged()[5].figures.at("behind"), 0.0);
  leave_out(0.4);
  EXPECT_NEAR(judged()[5].figures.at("behind"), 0.4, 0.05);
  for (const double share : {0.6, 1.0}) {
    leave_out(share);
    EXPECT_THAT(complaint(), AllOf(HasSubstr("1.5 times as far"), HasSubstr("wheel scale"),
                                   HasSubstr("unit of the wheel speeds")));
  }
  // Where nothing is registered either, it is the likelier cause.
  stretches_tried_ = 16;
  EXPECT_THAT(complaint(), AllOf(HasSubstr("do not agree"), HasSubstr("not dark? And of "),
                                 HasSubstr("unit of the wheel speeds")));
}

TEST_F(Verdict, AsksOnlyNeighboursWhatLiesBehind) {
  graph_.tracks = drive_.tracks({1, 6});
  for (TrackFactor& factor : graph_.tracks) {
    if (factor.to != factor.from + 1) {
      factor.behind = factor.tracks.size() + 100;
    }
  }
  EXPECT_NO_THROW((void)judged());
}

TEST_F(Verdict, KeepsADriveInWhichAFewTracksMiss) {
  graph_.tracks = drive_.tracks({1});
  for (SurfaceTrack& track : graph_.tracks[5].tracks) {
    track.to_px.y() += 3.0;
  }
  const auto poses = judged();
  EXPECT_NEAR(poses[5].figures.at("track_residual_px"), 3.0, 1e-6);
  EXPECT_NEAR(poses[6].figures.at("track_residual_px"), 0.0, 1e-6);
}

}  // namespace
}  // namespace topoloc::refinement
