// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/map_update.hpp"

#include "topoloc/estimation/manifold_prior.hpp"

#include "support/camera_scene.hpp"

#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using namespace error_index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using test::Random;

const CameraModel kCamera = test::forward_camera();

/// No gates and no robust weights, a fixed number of iterations: the bare iterated Kalman filter.
MapUpdateConfig plain(int iterations) {
  return {.max_iterations = iterations,
          .convergence_theta_rad = 0.0,
          .convergence_p_m = 0.0,
          .match_gate_chi2 = 1e12,
          .kernel = RobustKernel::kNone,
          .kernel_width_sigma = 1e6,
          .min_matches = 1,
          .min_gate_share = 0.0,
          .pose_gate_chi2 = 1e12};
}

struct Posterior {
  NominalState x;
  Covariance P;
};

/// The textbook iterated filter with everything stacked: N x N innovation form of the gain, the
/// nodes' pose errors as further states (6 each) which are marginalised by dropping their rows.
Posterior dense_reference(const MapMatchSet& set, const NominalState& x_bar,
                          const Covariance& P_bar, int iterations) {
  const int dim = kErrorDim + 6 * set.node_count;
  const int rows = 2 * set.match_count;
  NominalState x_k = x_bar;
  VectorXd nodes = VectorXd::Zero(dim - kErrorDim);
  MatrixXd P_joint = MatrixXd::Zero(dim, dim);
  P_joint.topLeftCorner(kErrorDim, kErrorDim) = P_bar;
  for (int n = 0; n < set.node_count; ++n) {
    P_joint.block<6, 6>(kErrorDim + 6 * n, kErrorDim + 6 * n) =
        set.nodes[static_cast<std::size_t>(n)].covariance;
  }
  MatrixXd P_post;
  Vector3d last_theta;
  for (int k = 0; k < iterations; ++k) {
    MatrixXd H = MatrixXd::Zero(rows, dim);
    VectorXd z(rows);
    MatrixXd R = MatrixXd::Identity(rows, rows);
    const RigidTransform T_cam_world = camera_pose(x_k, kCamera);
    for (int i = 0; i < set.match_count; ++i) {
      const MapMatch& match = set.matches[static_cast<std::size_t>(i)];
      const MatchedNode& node = set.nodes[static_cast<std::size_t>(match.node_slot)];
      const auto m =
          linearise_reprojection(kCamera.pinhole, T_cam_world, match.pixel_px, match.p_world_m);
      H.block<2, 6>(2 * i, 0) = m->G * vehicle_motion(x_k, kCamera);
      H.block<2, 6>(2 * i, kErrorDim + 6 * match.node_slot) =
          m->G * body_motion(T_cam_world * RigidTransform{node.R_world_cam, node.p_world_cam},
                             T_cam_world.R);
      // The nodes stay linearised where the map has them.
      z.segment<2>(2 * i) = m->z_px + H.block(2 * i, kErrorDim, 2, dim - kErrorDim) * nodes;
      R.diagonal().segment<2>(2 * i).setConstant(match.pixel_std_px * match.pixel_std_px);
    }
    MatrixXd J_inverse = MatrixXd::Identity(dim, dim);
    J_inverse.topLeftCorner(kErrorDim, kErrorDim) = prior_jacobian(x_k, x_bar).inverse();
    const MatrixXd P = J_inverse * P_joint * J_inverse.transpose();
    VectorXd offset(dim);
    offset << boxminus(x_k, x_bar), nodes;
    offset = J_inverse * offset;
    const MatrixXd K = P * H.transpose() * (H * P * H.transpose() + R).inverse();
    const VectorXd dx = -K * (z - H * offset) - offset;
    x_k = boxplus(x_k, dx.head<kErrorDim>());
    nodes += dx.tail(dim - kErrorDim);
    P_post = (MatrixXd::Identity(dim, dim) - K * H) * P;
    last_theta = dx.head<3>();
  }
  Covariance P_state = P_post.topLeftCorner(kErrorDim, kErrorDim);
  move_to_updated_state(last_theta, P_state);
  return {x_k, P_state};
}

struct Scene {
  NominalState truth;
  NominalState x;  ///< prior
  Covariance P;
  MapMatchSet set;
};

Scene make_scene(std::uint64_t seed, int matches, double prior_scale, double noise_px = 1.0) {
  Random random(seed);
  Scene scene;
  scene.truth = test::random_state(random);
  scene.P = test::random_covariance(random, prior_scale);
  test::fill_matches(scene.truth.T_world_imu(), kCamera, matches, noise_px, random, scene.set);
  const ErrorVector error = scene.P.llt().matrixL() * random.normal_vector<kErrorDim>();
  scene.x = boxplus(scene.truth, error);
  return scene;
}

TEST(MapUpdate, EqualsTheDenseInnovationForm) {
  for (const int iterations : {1, 2, 5}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Scene scene = make_scene(seed, 12, 0.05);
      scene.set.matches[3].pixel_std_px = 2.5;
      const Posterior expected = dense_reference(scene.set, scene.x, scene.P, iterations);
      const MapUpdateResult result =
          MapUpdate(kCamera, plain(iterations)).apply(scene.set, scene.x, scene.P);
      ASSERT_EQ(result.verdict, MapVerdict::kAccepted);
      EXPECT_EQ(result.iterations, iterations);
      EXPECT_LT(boxminus(scene.x, expected.x).norm(), 1e-9) << iterations << ' ' << seed;
      EXPECT_LT((scene.P - expected.P).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(MapUpdate, MarginalisingNodesEqualsTheAugmentedState) {
  for (const int iterations : {1, 4}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Scene scene = make_scene(seed, 16, 0.05);
      Random random(seed + 100);
      scene.set.node_count = 2;
      scene.set.nodes[1] = scene.set.nodes[0];
      scene.set.nodes[1].p_world_cam += Vector3d(2.0, 0.5, 0.0);
      for (int n = 0; n < 2; ++n) {
        scene.set.nodes[static_cast<std::size_t>(n)].covariance =
            test::random_covariance(random, n == 0 ? 0.02 : 0.05).topLeftCorner<6, 6>();
      }
      for (int i = 0; i < scene.set.match_count; i += 3) {
        scene.set.matches[static_cast<std::size_t>(i)].node_slot = 1;
      }
      const Posterior expected = dense_reference(scene.set, scene.x, scene.P, iterations);
      const MapUpdateResult result =
          MapUpdate(kCamera, plain(iterations)).apply(scene.set, scene.x, scene.P);
      ASSERT_EQ(result.verdict, MapVerdict::kAccepted);
      EXPECT_LT(boxminus(scene.x, expected.x).norm(), 1e-8) << iterations << ' ' << seed;
      EXPECT_LT((scene.P - expected.P).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(MapUpdate, ManyMatchesDoNotMakeItBelieveAnUncertainNode) {
  Scene scene = make_scene(3, 2000, 0.5);
  constexpr double kNodeStd_m = 0.1;
  scene.set.nodes[0].covariance.diagonal().tail<3>().setConstant(kNodeStd_m * kNodeStd_m);
  MapUpdate(kCamera, plain(5)).apply(scene.set, scene.x, scene.P);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(std::sqrt(scene.P(kP + i, kP + i)), 0.9 * kNodeStd_m);
  }
}

// A prior far better than the node: the node's error is common to all residuals. It is explained by
// the node's covariance and contradicts nothing.
TEST(MapUpdate, AcceptsANodeThatIsOffWithinItsCovariance) {
  Scene scene = make_scene(4, 200, 0.002);
  const Vector3d node_error = scene.truth.R_world_imu * Vector3d(0.0, 0.25, 0.0);
  for (int i = 0; i < scene.set.match_count; ++i) {
    scene.set.matches[static_cast<std::size_t>(i)].p_world_m += node_error;
  }
  scene.set.nodes[0].covariance.diagonal() << 1e-6, 1e-6, 1e-6, 0.04, 0.04, 0.04;
  const MapUpdateResult result = MapUpdate(kCamera, {}).apply(scene.set, scene.x, scene.P);
  EXPECT_EQ(result.verdict, MapVerdict::kAccepted) << name(result.verdict);
  EXPECT_GT(result.inliers, 150);
  EXPECT_LT((scene.x.p_world_imu - scene.truth.p_world_imu).norm(), 0.01);
}

TEST(MapUpdate, ConvergesFromOneMetreAndThreeDegreesWithOutliers) {
  int converged = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scene scene = make_scene(seed, 200, 0.1);
    Random random(seed + 50);
    ErrorVector error = ErrorVector::Zero();
    error.segment<3>(kTheta) = 0.0524 * random.normal_vector<3>().normalized();
    error.segment<3>(kP) = random.normal_vector<3>().normalized();
    scene.x = boxplus(scene.truth, error);
    scene.P.setIdentity();
    scene.P.diagonal().head<3>().setConstant(0.05 * 0.05);
    for (int i = 0; i < 60; ++i) {  // 30 % outliers anywhere in the image
      scene.set.matches[static_cast<std::size_t>(i)].pixel_px = {random.uniform(0, 639),
                                                                 random.uniform(0, 383)};
    }
    const MapUpdateResult result = MapUpdate(kCamera, {}).apply(scene.set, scene.x, scene.P);
    const ErrorVector left = boxminus(scene.x, scene.truth);
    // At most a tenth of the prior's error is left, in one update.
    converged += result.verdict == MapVerdict::kAccepted && left.segment<3>(kP).norm() < 0.1 &&
                 left.segment<3>(kTheta).norm() < 0.00524;
  }
  EXPECT_EQ(converged, 20);
}

TEST(MapUpdate, RejectsGrossOutliersOneByOne) {
  Scene scene = make_scene(5, 100, 0.001);
  for (int i = 0; i < 10; ++i) {
    scene.set.matches[static_cast<std::size_t>(i)].pixel_px.x() += 100.0;
  }
  const MapUpdateResult result = MapUpdate(kCamera, {}).apply(scene.set, scene.x, scene.P);
  EXPECT_EQ(result.verdict, MapVerdict::kAccepted);
  EXPECT_GE(result.outside_gate, 10);
  EXPECT_LE(result.outside_gate, 12);
  EXPECT_LT((scene.x.p_world_imu - scene.truth.p_world_imu).norm(), 0.02);
}

// The gate is on squared distances: with std 2 px and gate 9.21 the limit lies at 2 * 3.035 px.
TEST(MapUpdate, GateComparesSquaredWithSquared) {
  const auto outside = [](double offset_px) {
    Scene scene = make_scene(6, 50, 0.1, 0.0);
    scene.x = scene.truth;
    scene.P.setZero();  // the state is known: S = R
    for (int i = 0; i < scene.set.match_count; ++i) {
      scene.set.matches[static_cast<std::size_t>(i)].pixel_std_px = 2.0;
    }
    scene.set.matches[0].pixel_px += Vector2d(0.6, -0.8) * offset_px;
    MapUpdateConfig config;
    config.match_gate_chi2 = 9.21;
    return MapUpdate(kCamera, config).apply(scene.set, scene.x, scene.P).outside_gate;
  };
  const double limit_px = 2.0 * std::sqrt(9.21);
  EXPECT_EQ(outside(0.999 * limit_px), 0);
  EXPECT_EQ(outside(1.001 * limit_px), 1);
}

// The gate opens with the prior's uncertainty: as wide as that, and not so wide that it is off.
TEST(MapUpdate, GateFollowsThePriorCovariance) {
  Scene scene = make_scene(7, 50, 0.1, 0.0);
  scene.x = scene.truth;
  scene.P.setZero();
  scene.P.diagonal().segment<3>(kP).setConstant(0.2 * 0.2);
  // A point 10 m straight ahead moves by 450 / 10 px per metre: sigma 9 px, plus 1 px of noise.
  scene.set.matches[0].p_world_m = scene.truth.T_world_imu() * Vector3d(11.0, 0.0, 0.3);
  const double limit_px = std::sqrt(13.8 * (81.0 + 1.0));
  for (const double factor : {0.99, 1.01}) {
    NominalState x = scene.x;
    Covariance P = scene.P;
    scene.set.matches[0].pixel_px = Vector2d(320.0 + factor * limit_px, 192.0);
    EXPECT_EQ(MapUpdate(kCamera, {}).apply(scene.set, x, P).outside_gate, factor < 1.0 ? 0 : 1);
  }
}

/// Equal weights but for one match that is off by offset_px: gives the information lost by it
/// relative to what it brings at full weight.
double weight_of(RobustKernel kernel, double offset_px) {
  Scene scene = make_scene(8, 40, 0.1, 0.0);
  scene.x = scene.truth;
  scene.P.setZero();
  MapUpdateConfig config = plain(1);
  config.kernel = kernel;
  config.kernel_width_sigma = 2.0;
  const auto information = [&](const MapMatchSet& set) {
    NominalState x = scene.x;
    Covariance P = scene.P;
    return MapUpdate(kCamera, config).apply(set, x, P).information.trace();
  };
  const double full = information(scene.set);
  MapMatchSet without = scene.set;
  without.matches[0].node_slot = 3;  // no such node: not used
  const double rest = information(without);
  scene.set.matches[0].pixel_px.x() += offset_px;
  return (information(scene.set) - rest) / (full - rest);
}

TEST(MapUpdate, RobustWeightsAreThoseOfTheKernels) {
  EXPECT_NEAR(weight_of(RobustKernel::kNone, 10.0), 1.0, 1e-9);
  EXPECT_NEAR(weight_of(RobustKernel::kHuber, 1.9), 1.0, 1e-9);
  EXPECT_NEAR(weight_of(RobustKernel::kHuber, 8.0), 0.25, 1e-9);  // c / r
  EXPECT_NEAR(weight_of(RobustKernel::kCauchy, 2.0), 0.5, 1e-9);  // 1 / (1 + r^2 / c^2)
  EXPECT_NEAR(weight_of(RobustKernel::kCauchy, 6.0), 0.1, 1e-9);
}

/// Applies and expects a rejection that leaves no trace.
MapUpdateResult expect_rejected(const Scene& scene, const MapUpdateConfig& config,
                                MapVerdict verdict) {
  NominalState x = scene.x;
  Covariance P = scene.P;
  const MapUpdateResult result = MapUpdate(kCamera, config).apply(scene.set, x, P);
  EXPECT_EQ(result.verdict, verdict) << name(result.verdict);
  EXPECT_EQ(P, scene.P);
  EXPECT_EQ(x.R_world_imu, scene.x.R_world_imu);
  EXPECT_EQ(boxminus(x, scene.x).tail<15>(), (Eigen::Matrix<double, 15, 1>::Zero()));
  return result;
}

TEST(MapUpdate, TooFewMatchesLeaveTheStateBitIdentical) {
  for (const int matches : {0, 1, 9}) {
    expect_rejected(make_scene(9, matches, 0.05), {}, MapVerdict::kTooFewMatches);
  }
}

TEST(MapUpdate, ContradictingMatchesLeaveTheStateBitIdentical) {
  Scene scene = make_scene(10, 100, 0.001);
  scene.x.p_world_imu += Vector3d(5.0, 5.0, 0.0);  // a prior far too sure of itself
  expect_rejected(scene, {}, MapVerdict::kTooFewInGate);
}

TEST(MapUpdate, TakesNoSideWhereNearlyHalfOfTheMatchesSayOtherwise) {
  Scene scene = make_scene(10, 100, 0.01);
  for (std::size_t i = 0; i < 45; ++i) {  // what they are on has moved
    scene.set.matches[i].pixel_px.x() += 40.0;
  }
  const MapUpdateResult result = expect_rejected(scene, {}, MapVerdict::kTooFewInGate);
  EXPECT_EQ(result.outside_gate, 45);
  MapUpdateConfig credulous;
  credulous.min_gate_share = 0.3;
  NominalState x = scene.x;
  Covariance P = scene.P;
  EXPECT_EQ(MapUpdate(kCamera, credulous).apply(scene.set, x, P).verdict, MapVerdict::kAccepted);
}

// Neither axis alone may slip through: z, roll and pitch are as untouched as x and y.
TEST(MapUpdate, UnbelievableCorrectionLeavesTheStateBitIdentical) {
  Scene scene = make_scene(11, 100, 0.01);
  scene.x = scene.truth;
  scene.x.p_world_imu += Vector3d(0.5, 0.0, 0.0);  // 50 sigma
  MapUpdateConfig config;
  config.match_gate_chi2 = 1e9;
  config.kernel = RobustKernel::kNone;
  const MapUpdateResult result = expect_rejected(scene, config, MapVerdict::kInnovationTooLarge);
  EXPECT_GT(result.test_ratio, 1.0);
}

TEST(MapUpdate, PoseGateComparesSquaredWithSquared) {
  // P much larger than the measurement's noise: the correction is all of the prior's error.
  for (const double sigmas : {5.8, 6.0}) {  // sqrt(35) = 5.92
    Scene scene = make_scene(12, 1000, 0.1, 0.0);
    scene.P.setIdentity();
    scene.P *= 0.01;
    scene.P.diagonal().head<3>().setConstant(1e-2);
    scene.x = scene.truth;
    scene.x.p_world_imu.z() += 0.1 * sigmas;
    MapUpdateConfig config = plain(10);
    config.pose_gate_chi2 = 35.0;
    NominalState x = scene.x;
    Covariance P = scene.P;
    const MapUpdateResult result = MapUpdate(kCamera, config).apply(scene.set, x, P);
    EXPECT_EQ(result.verdict,
              sigmas < 5.9 ? MapVerdict::kAccepted : MapVerdict::kInnovationTooLarge);
    EXPECT_NEAR(result.test_ratio, sigmas * sigmas / 35.0, 0.02);
  }
}

TEST(MapUpdate, CountsInvalidMatchesAndUsesTheRest) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Scene scene = make_scene(13, 60, 0.01);
  auto& m = scene.set.matches;
  m[0].pixel_px.x() = nan;
  m[1].p_world_m.z() = nan;
  m[2].pixel_std_px = 0.0;
  m[3].pixel_std_px = nan;
  m[4].node_slot = 1;
  m[5].node_slot = -1;
  m[6].p_world_m = scene.truth.T_world_imu() * Vector3d(-10.0, 0.0, 0.0);  // behind
  m[7].pixel_px.y() = std::numeric_limits<double>::infinity();
  const MapUpdateResult result = MapUpdate(kCamera, {}).apply(scene.set, scene.x, scene.P);
  EXPECT_EQ(result.verdict, MapVerdict::kAccepted);
  EXPECT_EQ(result.invalid, 8);
  EXPECT_EQ(result.matches, 60);
  EXPECT_TRUE(all_finite(scene.x));
  EXPECT_LT((scene.x.p_world_imu - scene.truth.p_world_imu).norm(), 0.05);
}

TEST(MapUpdate, MalformedSetsAreRefused) {
  Scene scene = make_scene(14, 60, 0.01);
  for (const int count : {-1, kMaxMatches + 1}) {
    Scene bad = scene;
    bad.set.match_count = count;
    expect_rejected(bad, {}, MapVerdict::kNotFinite);
    bad = scene;
    bad.set.node_count = count < 0 ? count : kMaxMatchedNodes + 1;
    expect_rejected(bad, {}, MapVerdict::kNotFinite);
  }
  Scene bad = scene;
  bad.set.nodes[0].covariance(2, 2) = std::numeric_limits<double>::quiet_NaN();
  expect_rejected(bad, {}, MapVerdict::kNotFinite);
  bad = scene;
  bad.x.v_world_imu.x() = std::numeric_limits<double>::quiet_NaN();
  NominalState x = bad.x;
  EXPECT_EQ(MapUpdate(kCamera, {}).apply(bad.set, x, bad.P).verdict, MapVerdict::kNotFinite);
}

TEST(MapUpdate, SwitchedOffStatesStayAsTheyAre) {
  Scene scene = make_scene(15, 100, 0.02);
  for (const int at : {kG, kBa}) {
    scene.P.middleRows<3>(at).setZero();
    scene.P.middleCols<3>(at).setZero();
  }
  const NominalState before = scene.x;
  ASSERT_EQ(MapUpdate(kCamera, {}).apply(scene.set, scene.x, scene.P).verdict,
            MapVerdict::kAccepted);
  EXPECT_EQ(scene.x.gravity_mps2, before.gravity_mps2);
  EXPECT_EQ(scene.x.accel_bias_mps2, before.accel_bias_mps2);
  for (const int at : {kG, kBa}) {
    EXPECT_TRUE(scene.P.middleRows<3>(at).isZero(0.0));
    EXPECT_TRUE(scene.P.middleCols<3>(at).isZero(0.0));
  }
}

TEST(MapUpdate, CovarianceStaysSymmetricAndPositive) {
  for (const double prior_scale : {1e-6, 1e-2, 1.0}) {
    Scene scene = make_scene(16, 2048, prior_scale);
    MapUpdate update(kCamera, plain(3));
    for (int k = 0; k < 20; ++k) {
      ASSERT_EQ(update.apply(scene.set, scene.x, scene.P).verdict, MapVerdict::kAccepted);
      EXPECT_EQ(scene.P, scene.P.transpose().eval());
      const auto eigenvalues = scene.P.selfadjointView<Eigen::Lower>().eigenvalues().eval();
      EXPECT_GT(eigenvalues.minCoeff(), -1e-14 * eigenvalues.maxCoeff()) << prior_scale;
    }
  }
}

TEST(MapUpdate, UsingItTwiceGivesTheSameBits) {
  Scene a = make_scene(17, 300, 0.05);
  Scene b = a;
  MapUpdate update(kCamera, {});
  Scene other = make_scene(18, 500, 0.05);
  update.apply(a.set, a.x, a.P);
  update.apply(other.set, other.x, other.P);  // leaves nothing behind in the buffers
  update.apply(b.set, b.x, b.P);
  EXPECT_EQ(a.P, b.P);
  EXPECT_EQ(a.x.R_world_imu, b.x.R_world_imu);
  EXPECT_EQ(a.x.p_world_imu, b.x.p_world_imu);
}

}  // namespace
}  // namespace topoloc::estimation
