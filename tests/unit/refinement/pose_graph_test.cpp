// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/pose_graph.hpp"

#include "unit/refinement/graph_drive.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

/// Solves from `start` and returns the poses.
std::vector<RigidTransform> solved(const PoseGraph& graph, std::vector<RigidTransform> start,
                                   std::size_t first = 0, const SolverConfig& config = {}) {
  solve(graph, TexturedStreet::T_imu_cam(), TexturedStreet::camera(), first, config, start);
  return start;
}

std::vector<Matrix6> covariances_of(const PoseGraph& graph,
                                    const std::vector<RigidTransform>& poses) {
  return covariances(graph, TexturedStreet::T_imu_cam(), TexturedStreet::camera(), {}, poses);
}

/// Largest |motion_between| over all poses.
double largest_error(const std::vector<RigidTransform>& poses,
                     const std::vector<RigidTransform>& truth) {
  double largest = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    largest = std::max(largest, motion_between(truth[k], poses[k]).norm());
  }
  return largest;
}

/// Largest angle between poses.
double largest_turn_rad(const std::vector<RigidTransform>& poses,
                        const std::vector<RigidTransform>& truth) {
  double largest = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    largest = std::max(largest, motion_between(truth[k], poses[k]).head<3>().norm());
  }
  return largest;
}

/// Each pose off by its own motion.
std::vector<RigidTransform> disturbed(const std::vector<RigidTransform>& poses, double std_rad,
                                      double std_m, std::uint64_t seed) {
  test::Random random(seed);
  std::vector<RigidTransform> result;
  for (const RigidTransform& pose : poses) {
    result.push_back(moved(pose, random.normal_vector<6>().cwiseProduct(both(std_rad, std_m))));
  }
  return result;
}

bool same_bits(const std::vector<RigidTransform>& a, const std::vector<RigidTransform>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(),
      [](const RigidTransform& x, const RigidTransform& y) { return x.R == y.R && x.p == y.p; });
}

TEST(PoseGraph, SolvesExactFactorsFromDisturbedStarts) {
  const GraphDrive drive(8);
  PoseGraph graph = drive.with_odometry();
  graph.priors.push_back({0, drive.truth[0], both(0.01, 0.1)});
  graph.registrations.push_back(drive.registration(5, 0.005, 0.05));
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    graph.gravity.push_back({k, drive.truth[k].R.row(2).transpose(), 0.003});
    graph.ground.push_back(drive.ground(k));
  }
  graph.tracks = drive.tracks({1, 3});
  const auto start = disturbed(drive.truth, 0.01, 0.1, 3);
  ASSERT_GT(largest_error(start, drive.truth), 0.1);
  EXPECT_LT(largest_error(solved(graph, start), drive.truth), 1e-6);
}

TEST(PoseGraph, TakesThePlaceBesideSurfacesFromTracksAndOdometry) {
  const GraphDrive drive(16);
  // The whole drive is off by one motion, and the prior says that it is not.
  Vector6 wrong;
  wrong << 0.0, 0.015, 0.0, 0.2, 0.2, 0.15;
  const RigidTransform motion = moved(drive.truth[0], wrong) * drive.truth[0].inverse();
  std::vector<RigidTransform> start;
  for (const RigidTransform& pose : drive.truth) {
    start.push_back(motion * pose);
  }
  PoseGraph graph = drive.with_odometry();
  graph.priors.push_back({0, start[0], both(0.1, 1.0)});
  EXPECT_GT(largest_error(solved(graph, start), drive.truth), 0.3);  // without tracks
  graph.tracks = drive.tracks({1, 3, 6});
  SolverConfig config;
  config.tracks_per_pair = 1.0;  // these have no errors to share
  const auto poses = solved(graph, start, 0, config);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector6 off = motion_between(drive.truth[k], poses[k]);
    EXPECT_LT(std::abs(off(1)), 0.002) << "pitch of " << k;
    EXPECT_LT(std::abs(off(4)), 0.02) << "lateral of " << k;
    EXPECT_LT(std::abs(off(5)), 0.02) << "height of " << k;
    // Walls and ground look the same all along.
    EXPECT_GT(off(3), 0.1) << "along of " << k;
  }
}

TEST(PoseGraph, DoesNotTakeTheHeightFromTracksThatAreOff) {
  const GraphDrive drive(10);
  PoseGraph graph = drive.with_odometry();
  graph.priors.push_back({0, drive.truth[0], both(0.05, 0.5)});
  graph.tracks = drive.tracks({1, 3});
  for (TrackFactor& factor : graph.tracks) {
    for (std::size_t i = 0; i < factor.tracks.size(); i += 5) {
      factor.tracks[i].to_px += Eigen::Vector2d(15.0, 12.0);  // on another car
    }
  }
  EXPECT_LT(largest_error(solved(graph, drive.truth), drive.truth), 0.03);
}

TEST(PoseGraph, FindsAConstantErrorOfTheGyro) {
  const GraphDrive drive(20);
  const Eigen::Vector3d rate_error_radps(0.001, -0.002, 0.004);
  PoseGraph graph = drive.with_odometry(both(0.0003, 0.02));
  for (OdometryFactor& factor : graph.odometry) {
    factor.T_from_to.R = factor.T_from_to.R * so3::exp(factor.seconds * rate_error_radps);
  }
  graph.registrations = {drive.registration(0, 0.001, 0.02), drive.registration(12, 0.001, 0.02)};
  // What was found between the registrations holds beyond them, too.
  EXPECT_LT(largest_turn_rad(solved(graph, drive.truth), drive.truth), 0.0007);
  graph.rate_error_std_radps = 1e-9;
  EXPECT_GT(largest_turn_rad(solved(graph, drive.truth), drive.truth), 0.004);
}

TEST(PoseGraph, FindsHowTheImuIsTurnedAgainstTheWayAndTheWheelsScale) {
  const GraphDrive drive(20);
  const Eigen::Vector3d turn_error_rad(0.0, 0.004, -0.006);
  constexpr double kScaleError = 0.008;
  PoseGraph graph = drive.with_odometry(both(0.0003, 0.003));
  for (OdometryFactor& factor : graph.odometry) {
    factor.T_from_to.p +=
        kScaleError * factor.T_from_to.p + turn_error_rad.cross(factor.T_from_to.p);
  }
  graph.registrations = {drive.registration(0, 0.001, 0.01), drive.registration(12, 0.001, 0.01)};
  graph.turn_error_std_rad = 0.005;
  // What was found between the registrations holds beyond them, too.
  EXPECT_LT(largest_error(solved(graph, drive.truth), drive.truth), 0.02);
  graph.turn_error_std_rad = graph.scale_error_std = 0.0;
  EXPECT_GT(largest_error(solved(graph, drive.truth), drive.truth), 0.05);
}

TEST(PoseGraph, FindsScaleAndAxesOfTheGyroInTurns) {
  // There and back round a bend: a bias would not do that.
  GraphDrive drive(40);
  Eigen::Matrix3d error;
  error << 0.004, -0.003, 0.006, 0.002, -0.005, -0.004, 0.001, 0.003, 0.008;
  for (std::size_t k = 1; k < drive.truth.size(); ++k) {
    const double turn_rad = k < 20 ? 0.12 : -0.12;
    drive.truth[k] = drive.truth[k - 1] * RigidTransform{so3::exp({0.0, 0.0, turn_rad}),
                                                         {GraphDrive::kStep_m, 0.0, 0.0}};
  }
  PoseGraph graph = drive.with_odometry(both(0.0002, 0.005));
  for (OdometryFactor& factor : graph.odometry) {
    const Eigen::Vector3d turned = so3::log(factor.T_from_to.R);
    factor.T_from_to.R = so3::exp(turned + error * turned);
  }
  for (const std::size_t k : {0U, 10U, 39U}) {
    graph.registrations.push_back(drive.registration(k, 0.001, 0.02));
  }
  graph.gyro_scale_std = 0.01;
  EXPECT_LT(largest_turn_rad(solved(graph, drive.truth), drive.truth), 0.004);
  graph.gyro_scale_std = 0.0;
  EXPECT_GT(largest_turn_rad(solved(graph, drive.truth), drive.truth), 0.008);
}

TEST(PoseGraph, VotesDownAGrossOutlierAmongRegistrations) {
  const GraphDrive drive(12);
  PoseGraph graph = drive.with_odometry();
  for (std::size_t k = 0; k < drive.truth.size(); k += 2) {
    graph.registrations.push_back(drive.registration(k, 0.005, 0.05));
  }
  Vector6 gross = Vector6::Zero();
  gross << 0.0, 0.0, 0.05, 2.0, -1.0, 0.3;
  Registration& outlier = graph.registrations[3];
  outlier.T_world_imu = moved(outlier.T_world_imu, gross);
  EXPECT_LT(largest_error(solved(graph, disturbed(drive.truth, 0.005, 0.05, 8)), drive.truth),
            0.06);
}

TEST(PoseGraph, LeavesPosesBeforeTheFirstWhereTheyAre) {
  const GraphDrive drive(10);
  PoseGraph graph = drive.with_odometry(both(0.02, 0.3));
  graph.registrations.push_back(drive.registration(8, 0.002, 0.02));
  graph.priors.push_back({1, drive.truth[1], both(0.001, 0.01)});
  const auto start = disturbed(drive.truth, 0.01, 0.2, 9);
  constexpr std::size_t kFirst = 4;
  const auto poses = solved(graph, start, kFirst);
  EXPECT_TRUE(
      same_bits({poses.begin(), poses.begin() + kFirst}, {start.begin(), start.begin() + kFirst}));
  EXPECT_LT(motion_between(drive.truth[8], poses[8]).norm(),
            0.3 * motion_between(drive.truth[8], start[8]).norm());
  // Factors of keyframes that are not there yet are left out.
  const std::vector<RigidTransform> only_six(start.begin(), start.begin() + 6);
  EXPECT_EQ(solved(graph, only_six, kFirst).size(), 6U);
}

/// A prior on the first pose, gravity and the road everywhere.
PoseGraph on_the_road(const GraphDrive& drive, const Vector6& odometry_std) {
  PoseGraph graph = drive.with_odometry(odometry_std);
  graph.priors.push_back({0, drive.truth[0], both(0.01, 0.1)});
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    graph.ground.push_back(drive.ground(k));
    graph.gravity.push_back({k, drive.truth[k].R.row(2).transpose(), 0.003});
  }
  return graph;
}

TEST(PoseGraph, KeepsOneHeightAboveTheRoad) {
  const GraphDrive drive(9);
  PoseGraph graph = on_the_road(drive, both(0.002, 0.1));
  for (OdometryFactor& factor : graph.odometry) {
    factor.T_from_to.p.z() += 0.05;  // it climbs
  }
  // How high the vehicle is above the road is not known beforehand.
  for (const RigidTransform& pose : solved(graph, drive.truth)) {
    EXPECT_NEAR(pose.p.z(), drive.truth[0].p.z(), 0.03);
  }
  graph.ground.clear();
  EXPECT_GT(solved(graph, drive.truth).back().p.z(), drive.truth.back().p.z() + 0.3);
}

TEST(PoseGraph, IsNotLiftedOntoARoof) {
  const GraphDrive drive(9);
  PoseGraph graph = on_the_road(drive, both(0.0005, 0.005));
  graph.ground[4].ground.height_m += 2.0;
  for (const RigidTransform& pose : solved(graph, drive.truth)) {
    EXPECT_NEAR(pose.p.z(), drive.truth[0].p.z(), 0.03);
  }
}

TEST(PoseGraph, GetsUprightByGravity) {
  const GraphDrive drive(2);
  PoseGraph graph;
  Vector6 tilt = Vector6::Zero();
  tilt.head<3>() << 0.02, -0.03, 0.0;
  std::vector<RigidTransform> start;
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    start.push_back(moved(drive.truth[k], tilt));
    graph.priors.push_back({k, start[k], both(0.1, 0.1)});
    graph.gravity.push_back({k, drive.truth[k].R.row(2).transpose(), 0.001});
  }
  for (const RigidTransform& pose : solved(graph, start)) {
    EXPECT_NEAR(pose.R(2, 2), 1.0, 1e-6);
  }
}

TEST(PoseGraph, FindsAConstantErrorOfTheForceWhereOthersKnowBetter) {
  // An accelerometer bias tilts what inertia takes for up, on all poses alike.
  const GraphDrive drive(12);
  const Eigen::Vector3d bias_mps2(0.2, -0.1, 0.0);
  const auto largest_tilt = [&](double std_mps2) {
    PoseGraph graph = drive.with_odometry();
    graph.force_error_std_mps2 = std_mps2;
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      const Eigen::Vector3d up = drive.truth[k].R.row(2).transpose() + bias_mps2 / 9.81;
      graph.gravity.push_back({k, up, 0.002});
    }
    graph.registrations.push_back(drive.registration(6, 0.005, 0.05));
    double tilt = 0.0;
    const auto poses = solved(graph, drive.truth);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      tilt = std::max(tilt, (poses[k].R.row(2) - drive.truth[k].R.row(2)).norm());
    }
    return tilt;
  };
  EXPECT_LT(largest_tilt(0.2), 0.002);
  EXPECT_GT(largest_tilt(0.002), 0.015);  // held for impossible, it is believed
}

TEST(PoseGraph, KnowsSensorsWithoutErrors) {
  const GraphDrive drive(8);
  PoseGraph graph = drive.with_odometry();
  graph.registrations.push_back(drive.registration(3, 0.005, 0.05));
  const std::vector<Matrix6> with_errors = covariances_of(graph, drive.truth);
  graph.rate_error_std_radps = graph.turn_error_std_rad = graph.scale_error_std = 0.0;
  EXPECT_LT(largest_error(solved(graph, disturbed(drive.truth, 0.005, 0.05, 8)), drive.truth),
            1e-6);
  EXPECT_LT(covariances_of(graph, drive.truth).back().trace(), with_errors.back().trace());
}

TEST(PoseGraph, ShrinksCovariancesWithEachRegistration) {
  const GraphDrive drive(12);
  PoseGraph graph = drive.with_odometry();
  graph.registrations.push_back(drive.registration(0, 0.005, 0.05));
  std::vector<Matrix6> before = covariances_of(graph, drive.truth);
  EXPECT_GT(before.back().trace(), before.front().trace());
  for (const std::size_t keyframe : {11U, 6U, 3U}) {
    graph.registrations.push_back(drive.registration(keyframe, 0.005, 0.05));
    const std::vector<Matrix6> after = covariances_of(graph, drive.truth);
    for (std::size_t k = 0; k < after.size(); ++k) {
      EXPECT_LT(after[k].trace(), before[k].trace()) << k;
      EXPECT_GT(after[k].ldlt().vectorD().minCoeff(), 0.0) << k;
    }
    before = after;
  }
}

TEST(PoseGraph, TakesRegistrationsThatShareTheirErrorsForOne) {
  const GraphDrive drive(4);
  const auto covariances = [&](int registrations, double shared_by) {
    PoseGraph graph = drive.with_odometry();
    for (int i = 0; i < registrations; ++i) {
      graph.registrations.push_back(drive.registration(1, 0.005, 0.05));
      graph.registrations.back().shared_by = shared_by;
    }
    return covariances_of(graph, drive.truth);
  };
  const std::vector<Matrix6> one = covariances(1, 1.0);
  const std::vector<Matrix6> four = covariances(4, 4.0);
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_LT((four[k] - one[k]).norm(), 1e-9) << k;
  }
}

TEST(PoseGraph, HasTheCovarianceThatRepeatedSolvesScatterWith) {
  const GraphDrive drive(8);
  constexpr int kRuns = 150;
  constexpr double kRateErrorStd_radps = 0.002;
  const Vector6 odometry_std = both(0.001, 0.02);
  test::Random random(12);
  const auto draw = [&](const Vector6& std) -> Vector6 {
    return random.normal_vector<6>().cwiseProduct(std);
  };
  std::vector<Matrix6> scatter(drive.truth.size(), Matrix6::Zero());
  PoseGraph exact = drive.with_odometry(odometry_std);
  exact.rate_error_std_radps = kRateErrorStd_radps;
  exact.priors.push_back({0, drive.truth[0], both(0.01, 0.1)});
  exact.registrations = {drive.registration(2, 0.006, 0.06), drive.registration(6, 0.006, 0.06)};
  for (int run = 0; run < kRuns; ++run) {
    PoseGraph graph = exact;
    const Eigen::Vector3d rate_error = kRateErrorStd_radps * random.normal_vector<3>();
    const Eigen::Vector3d turn_error = exact.turn_error_std_rad * random.normal_vector<3>();
    const double scale_error = exact.scale_error_std * random.normal_vector<1>().value();
    for (OdometryFactor& factor : graph.odometry) {
      factor.T_from_to.R = factor.T_from_to.R * so3::exp(factor.seconds * rate_error);
      factor.T_from_to.p += scale_error * factor.T_from_to.p + turn_error.cross(factor.T_from_to.p);
      factor.T_from_to = moved(factor.T_from_to, draw(odometry_std));
    }
    graph.priors[0].T_world_imu = moved(graph.priors[0].T_world_imu, draw(both(0.01, 0.1)));
    for (Registration& registration : graph.registrations) {
      registration.T_world_imu = moved(registration.T_world_imu, draw(both(0.006, 0.06)));
    }
    const auto poses = solved(graph, drive.truth);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Vector6 off = motion_between(drive.truth[k], poses[k]);
      scatter[k] += off * off.transpose() / kRuns;
    }
  }
  const std::vector<Matrix6> P = covariances_of(exact, drive.truth);
  for (std::size_t k = 0; k < P.size(); ++k) {
    for (int i = 0; i < 6; ++i) {
      const double ratio = scatter[k](i, i) / P[k](i, i);
      EXPECT_GT(ratio, 0.6) << "keyframe " << k << ", " << i;
      EXPECT_LT(ratio, 1.6) << "keyframe " << k << ", " << i;
    }
    // All directions together: 6 where the covariance is right.
    EXPECT_NEAR((P[k].inverse() * scatter[k]).trace(), 6.0, 1.5) << k;
  }
}

TEST(PoseGraph, GivesTheSameBitsTwice) {
  const GraphDrive drive(10);
  PoseGraph graph = drive.with_odometry();
  graph.registrations.push_back(drive.registration(4, 0.005, 0.05));
  graph.tracks = drive.tracks({1, 3});
  const auto start = disturbed(drive.truth, 0.005, 0.05, 13);
  const auto once = solved(graph, start);
  EXPECT_TRUE(same_bits(once, solved(graph, start)));
  EXPECT_EQ(covariances_of(graph, once), covariances_of(graph, once));
}

TEST(PoseGraph, RefusesWhatHasNoCovariance) {
  const GraphDrive drive(4);
  PoseGraph graph = drive.with_odometry();  // nothing says where in the world
  EXPECT_THROW(covariances_of(graph, drive.truth), std::runtime_error);
  graph.registrations.push_back(drive.registration(1, 0.005, 0.05));
  graph.registrations[0].covariance(3, 3) = -1.0;
  EXPECT_THROW(solved(graph, drive.truth), std::invalid_argument);
}

TEST(PoseGraph, SaysHowFarTracksAreOff) {
  const GraphDrive drive(4);
  TrackFactor factor = drive.tracks({2}).front();
  ASSERT_GT(factor.tracks.size(), 2U);
  for (SurfaceTrack& track : factor.tracks) {
    track.std_px = 0.5;
    track.to_px += Eigen::Vector2d(3.0, 4.0);
  }
  const auto residuals_px = track_residuals_px(factor, TexturedStreet::T_imu_cam(),
                                               TexturedStreet::camera(), drive.truth);
  ASSERT_EQ(residuals_px.size(), factor.tracks.size());
  for (const double residual_px : residuals_px) {
    EXPECT_NEAR(residual_px, 5.0, 1e-6);
  }
}

TEST(Registration, MovesAndMeasuresMotionsInTheVehiclesAxes) {
  test::Random random(14);
  for (int i = 0; i < 20; ++i) {
    const RigidTransform T{random.rotation(), 10.0 * random.normal_vector<3>()};
    const Vector6 xi = 0.5 * random.normal_vector<6>();
    const RigidTransform there = moved(T, xi);
    EXPECT_LT((there.R - T.R * so3::exp(xi.head<3>())).norm(), 1e-12);
    EXPECT_LT((there.p - (T.p + T.R * xi.tail<3>())).norm(), 1e-12);
    EXPECT_LT((motion_between(T, there) - xi).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace topoloc::refinement
