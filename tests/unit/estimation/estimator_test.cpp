// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/estimator.hpp"

#include "topoloc/geometry/so3.hpp"

#include "support/straight_drive.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using Eigen::Vector3d;
using test::StraightDrive;

EstimatorConfig config() {
  EstimatorConfig c;
  c.models.camera = test::forward_camera();
  c.initial.position_m = 0.3;
  c.initial.attitude_rad = 0.01;
  return c;
}

/// Ticks at 100 Hz with IMU and speed in each, frames at 10 Hz if asked for.
class StraightRun {
 public:
  explicit StraightRun(const EstimatorConfig& c = config()) : estimator(c) {}

  void start() {
    inputs.initial_pose = InitialPose{.time_ns = StraightDrive::at(0.0) + clock_error_ns,
                                      .T_world_imu = drive.pose(0.0)};
  }
  const Estimate& step(bool frame, const Vector3d& offset_m = Vector3d::Zero()) {
    const double t = 0.01 * tick_count++;
    ImuSample imu = StraightDrive::imu(t);
    SpeedSample speed = drive.speed(t);
    imu.time_ns += clock_error_ns;
    speed.time_ns += clock_error_ns;
    speed.speed_mps *= wheel_factor;
    inputs.imu = {&imu, with_imu ? 1U : 0U};
    inputs.speed = {&speed, with_speed ? 1U : 0U};
    const MapMatchSet* set = &matches;
    if (frame && t >= 0.1) {
      drive.matches(t - 0.08, 60, matches, offset_m);
      matches.frame_time_ns += clock_error_ns;
      matches.nodes[0].node_id = static_cast<std::uint32_t>(tick_count);
      inputs.matches = {&set, 1};
    }
    const Estimate& estimate = estimator.tick(imu.time_ns, inputs);
    inputs = {};
    return estimate;
  }
  Estimate run(double seconds, bool frames, const Vector3d& offset_m = Vector3d::Zero()) {
    Estimate estimate;
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 100)); ++i) {
      estimate = step(frames && tick_count % 10 == 0, offset_m);
      EXPECT_TRUE(all_finite(estimate.state));
      EXPECT_TRUE(estimate.P.allFinite());
    }
    return estimate;
  }

  StraightDrive drive;
  Estimator estimator;
  TickInputs inputs;
  MapMatchSet matches;
  int tick_count = 0;
  std::int64_t clock_error_ns = 0;
  double wheel_factor = 1.0;
  bool with_imu = true;
  bool with_speed = true;
};

std::uint64_t sum(const std::array<std::uint64_t, kInsertVerdictCount>& counters) {
  return std::accumulate(counters.begin(), counters.end(), std::uint64_t{0});
}
std::uint64_t count(const std::array<std::uint64_t, kInsertVerdictCount>& counters,
                    InsertVerdict verdict) {
  return counters[static_cast<std::size_t>(verdict)];
}

TEST(Estimator, EmptyTicksBeforeTheStartSayUninitialised) {
  Estimator estimator(config());
  for (const std::int64_t now_ns : {std::int64_t{0}, StraightDrive::at(1.0)}) {
    EXPECT_EQ(estimator.tick(now_ns, {}).mode, Mode::kUninitialised);
  }
  Covariance P;
  EXPECT_FALSE(estimator.state_at(StraightDrive::at(0.0), P));
}

TEST(Estimator, StartsWithPoseInertialDataAndSpeed) {
  StraightRun run;
  EXPECT_EQ(run.run(0.1, false).mode, Mode::kUninitialised) << "no pose yet";
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(0.1), .T_world_imu = run.drive.pose(0.1)};
  const Estimate estimate = run.step(false);
  EXPECT_EQ(estimate.mode, Mode::kDeadReckoning) << "nothing of the map has been seen yet";
  EXPECT_EQ(estimate.reasons, reason::kNoMapFix);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 0.8, 1e-9);
  EXPECT_NEAR(estimate.state.v_world_imu.x(), 8.0, 1e-9);
}

TEST(Estimator, WaitsForASpeedUnlessToldNotTo) {
  for (const bool use_speed : {true, false}) {
    EstimatorConfig c = config();
    c.use_speed = use_speed;
    StraightRun run(c);
    run.with_speed = false;
    run.start();
    EXPECT_EQ(run.run(0.1, false).mode == Mode::kUninitialised, use_speed);
  }
}

TEST(Estimator, DoesNotStartBeforeThePosesTime) {
  StraightRun run;
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(0.5), .T_world_imu = run.drive.pose(0.5)};
  EXPECT_EQ(run.run(0.5, false).mode, Mode::kUninitialised);
  EXPECT_EQ(run.step(false).mode, Mode::kDeadReckoning);
}

TEST(Estimator, RefusesAnInitialPoseThatIsNone) {
  StraightRun run;
  InitialPose pose{.time_ns = StraightDrive::at(0.0), .T_world_imu = {}};
  pose.T_world_imu.p.x() = std::numeric_limits<double>::quiet_NaN();
  run.inputs.initial_pose = pose;
  run.step(false);
  pose.T_world_imu = {};
  pose.T_world_imu.R(0, 0) = std::numeric_limits<double>::quiet_NaN();
  run.inputs.initial_pose = pose;
  run.step(false);
  pose.T_world_imu.R = Eigen::Matrix3d::Zero();
  run.inputs.initial_pose = pose;
  run.step(false);
  pose.T_world_imu.R = -Eigen::Matrix3d::Identity();  // a reflection
  run.inputs.initial_pose = pose;
  const Estimate estimate = run.step(false);
  EXPECT_EQ(estimate.mode, Mode::kUninitialised);
  EXPECT_EQ(estimate.counters.initial_pose_rejected, 4U);
}

TEST(Estimator, CarriesAnOlderInitialPoseToItsStart) {
  Estimator estimator(config());
  const double rate_radps = 0.3;
  ImuSample imu = StraightDrive::imu(0.1);
  imu.angular_rate_radps = {0.0, 0.0, rate_radps};
  const SpeedSample speed{.time_ns = StraightDrive::at(0.1), .speed_mps = 8.0};
  const Estimate estimate = estimator.tick(
      imu.time_ns,
      {.imu = {&imu, 1},
       .speed = {&speed, 1},
       .matches = {},
       .initial_pose = InitialPose{.time_ns = StraightDrive::at(0.0), .T_world_imu = {}}});
  EXPECT_NEAR(so3::log(estimate.state.R_world_imu).z(), 0.1 * rate_radps, 1e-9);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 0.8, 0.01);
}

TEST(Estimator, SaysWhatItWaitsFor) {
  StraightRun run;
  EXPECT_EQ(run.estimator.tick(StraightDrive::at(0.0), {}).reasons,
            reason::kNoPose | reason::kNoImu | reason::kNoSpeed);
  run.with_speed = false;
  EXPECT_EQ(run.step(false).reasons, reason::kNoPose | reason::kNoSpeed);
  run.start();
  EXPECT_EQ(run.step(false).reasons, reason::kNoSpeed);
}

TEST(Estimator, DoesNotStartFromAnOldPoseOrSpeed) {
  StraightRun run;
  run.start();
  run.with_speed = false;
  const Estimate too_old = run.run(1.1, false);
  EXPECT_EQ(too_old.mode, Mode::kUninitialised);
  EXPECT_EQ(too_old.counters.initial_pose_rejected, 1U);

  run.with_speed = true;
  run.step(false);
  run.with_speed = false;
  run.run(0.7, false);  // that speed is old now
  const double now_s = 0.01 * run.tick_count;
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(now_s), .T_world_imu = run.drive.pose(now_s)};
  EXPECT_EQ(run.run(0.1, false).reasons, reason::kNoSpeed);
  run.with_speed = true;
  EXPECT_EQ(run.step(false).mode, Mode::kDeadReckoning);
}

TEST(Estimator, TracksTheDriveWithLateFrames) {
  StraightRun run;
  run.start();
  const Estimate estimate = run.run(5.0, true);
  EXPECT_EQ(estimate.mode, Mode::kTracking);
  EXPECT_EQ(estimate.reasons, 0U);
  EXPECT_GT(estimate.counters.map_accepted(), 45U);
  EXPECT_EQ(estimate.counters.map_rejected(), 0U);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 8.0 * 4.99, 0.05);
  EXPECT_LT(estimate.state.p_world_imu.tail<2>().norm(), 0.05);
  EXPECT_LT(estimate.since_fix_s, 0.3);
  EXPECT_LT(estimate.since_fix_m, 2.0);
  EXPECT_EQ(estimate.time_ns, StraightDrive::at(4.99));
}

TEST(Estimator, GoesFromTrackingToDeadReckoningToLost) {
  EstimatorConfig c = config();
  c.health.lost_position_std_m = 0.5;
  StraightRun run(c);
  run.start();
  EXPECT_EQ(run.run(2.0, true).mode, Mode::kTracking);
  Estimate estimate = run.run(1.2, false);
  EXPECT_EQ(estimate.mode, Mode::kDeadReckoning);
  EXPECT_EQ(estimate.reasons, reason::kNoMapFix);
  EXPECT_NEAR(estimate.since_fix_s, 1.3, 0.11);
  EXPECT_NEAR(estimate.since_fix_m, 8.0 * estimate.since_fix_s, 1.0);
  estimate = run.run(60.0, false);
  EXPECT_EQ(estimate.mode, Mode::kLost);
  EXPECT_EQ(estimate.reasons, reason::kNoMapFix | reason::kUncertain);
}

TEST(Estimator, SaysWhatIsMissing) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  run.with_speed = false;
  EXPECT_EQ(run.run(0.6, true).reasons, reason::kNoSpeed);
  run.with_imu = false;
  EXPECT_EQ(run.run(0.3, false).reasons & reason::kNoImu, reason::kNoImu);
  run.with_imu = true;
  const Estimate after_gap = run.step(false);
  EXPECT_EQ(after_gap.reasons & reason::kImuGap, reason::kImuGap);
  EXPECT_EQ(after_gap.counters.imu_gaps, 1U);
  EXPECT_EQ(run.step(false).reasons & reason::kImuGap, 0U);
}

// A car may brake and turn while nobody looks.
TEST(Estimator, GrowsUncertainOverAGapInInertialData) {
  StraightRun run;
  run.start();
  const Estimate before = run.run(3.0, true);
  run.with_imu = false;
  run.with_speed = false;
  const Estimate during = run.run(2.0, false);
  const double p_std_m = 0.5 * 3.0 * 2.0 * 2.0;
  EXPECT_NEAR(std::sqrt(during.P(error_index::kP, error_index::kP)), p_std_m, 0.1);
  EXPECT_NEAR(std::sqrt(during.P(error_index::kTheta + 2, error_index::kTheta + 2)), 0.6, 0.01);
  EXPECT_EQ(during.mode, Mode::kLost);
  run.with_imu = true;
  const Estimate after = run.step(false);
  EXPECT_GT(std::sqrt(after.P(error_index::kP, error_index::kP)), 0.9 * p_std_m);
  EXPECT_LT(before.P(error_index::kP, error_index::kP), 0.01);
}

TEST(Estimator, OneTimeStampFarAheadDoesNotStopIt) {
  StraightRun run;
  run.start();
  run.run(3.0, true);
  run.clock_error_ns = 3'600'000'000'000;
  run.with_speed = false;
  run.step(false);
  run.clock_error_ns = 0;
  run.with_speed = true;
  const Estimate estimate = run.run(1.0, true);
  EXPECT_EQ(estimate.mode, Mode::kTracking);
  EXPECT_EQ(count(estimate.counters.imu, InsertVerdict::kInFuture), 1U);
  EXPECT_LT((estimate.state.p_world_imu - run.drive.pose(0.01 * (run.tick_count - 1)).p).norm(),
            0.1);
}

TEST(Estimator, WaitsForAPoseAfterTheClockWasSetAhead) {
  StraightRun run;
  run.start();
  run.run(3.0, true);
  run.clock_error_ns = 3'600'000'000'000;
  const Estimate estimate = run.run(0.1, false);
  EXPECT_EQ(estimate.mode, Mode::kUninitialised);
  EXPECT_EQ(estimate.reasons, reason::kNoPose);
  const double now_s = 0.01 * run.tick_count;
  run.inputs.initial_pose = InitialPose{.time_ns = StraightDrive::at(now_s) + run.clock_error_ns,
                                        .T_world_imu = run.drive.pose(now_s)};
  EXPECT_EQ(run.run(1.0, true).mode, Mode::kTracking);
}

// The doubt comes at the time of the frame that was refused last: this frame then is believed.
TEST(Estimator, TellsOfAFrameThatIsBelievedAfterAll) {
  StraightRun run;
  run.start();
  const std::uint64_t accepted_before = run.run(3.0, true).counters.map_accepted();
  bool revised = false;
  for (int i = 0; i < 100 && !revised; ++i) {
    const Estimate& estimate = run.step(run.tick_count % 10 == 0, {0.0, 1.5, 0.0});
    for (const MapUpdateReport& report : run.estimator.map_reports()) {
      if (report.revised) {
        revised = true;
        EXPECT_EQ(report.result.verdict, MapVerdict::kAccepted);
        EXPECT_GT(report.jump_m, 0.1);
        EXPECT_EQ(estimate.last_jump_m, report.jump_m);
        EXPECT_EQ(estimate.counters.map_accepted(), accepted_before + 1);
        EXPECT_EQ(estimate.counters.map_rejected(), 4U);
        EXPECT_LT(estimate.since_fix_s, 0.2);
      }
    }
  }
  EXPECT_TRUE(revised);
}

// A map that suddenly disagrees by 1.5 m: refused at first, doubted, and then followed.
TEST(Estimator, DoubtsItselfWhenFramesKeepContradicting) {
  StraightRun run;
  run.start();
  run.run(3.0, true);
  const Vector3d offset(0.0, 1.5, 0.0);
  Estimate estimate = run.run(0.3, true, offset);
  EXPECT_EQ(estimate.reasons & reason::kMapContradicts, reason::kMapContradicts);
  EXPECT_GE(estimate.counters.map_rejected(), 2U);
  EXPECT_LT(std::abs(estimate.state.p_world_imu.y()), 0.1);
  estimate = run.run(2.0, true, offset);
  EXPECT_GE(estimate.counters.doubts, 1U);
  EXPECT_EQ(estimate.mode, Mode::kTracking);
  EXPECT_EQ(estimate.reasons, 0U);
  EXPECT_NEAR(estimate.state.p_world_imu.y(), 1.5, 0.1);
}

TEST(Estimator, CountsEveryDatum) {
  StraightRun run;
  run.run(0.2, true);  // all before the start
  run.start();
  run.run(2.0, true);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::array<ImuSample, 3> imu = {ImuSample{.time_ns = StraightDrive::at(1.0),
                                                  .specific_force_mps2 = {nan, 0, 0},
                                                  .angular_rate_radps = {0, 0, 0}},
                                        StraightDrive::imu(1.0), StraightDrive::imu(2.195)};
  const std::array<SpeedSample, 4> speed = {
      SpeedSample{.time_ns = StraightDrive::at(0.3), .speed_mps = 8.0},
      SpeedSample{.time_ns = StraightDrive::at(2.0), .speed_mps = 8.0},
      SpeedSample{.time_ns = StraightDrive::at(2.1), .speed_mps = nan},
      SpeedSample{.time_ns = StraightDrive::at(99.0), .speed_mps = 8.0}};
  MapMatchSet bad;
  bad.match_count = -5;
  MapMatchSet old;
  run.drive.matches(0.5, 50, old);
  const std::array<const MapMatchSet*, 2> sets = {&bad, &old};
  const Estimate estimate = run.estimator.tick(
      StraightDrive::at(2.2), {.imu = imu, .speed = speed, .matches = sets, .initial_pose = {}});
  const Counters& c = estimate.counters;
  EXPECT_EQ(count(c.imu, InsertVerdict::kNotFinite), 1U);
  EXPECT_EQ(count(c.imu, InsertVerdict::kNotMonotonic), 1U);
  EXPECT_EQ(count(c.speed, InsertVerdict::kTooOld), 1U);
  EXPECT_EQ(count(c.speed, InsertVerdict::kDuplicate), 1U);
  EXPECT_EQ(count(c.speed, InsertVerdict::kNotFinite), 1U);
  EXPECT_EQ(count(c.speed, InsertVerdict::kInFuture), 1U);
  EXPECT_EQ(count(c.matches, InsertVerdict::kNotFinite), 1U);
  EXPECT_EQ(count(c.matches, InsertVerdict::kTooOld), 2U) << "and the frame of before the start";
  const std::uint64_t ticks = 220;
  const std::uint64_t frames = 21;  // every tenth tick from 0.1 s
  EXPECT_EQ(sum(c.imu), ticks + imu.size());
  EXPECT_EQ(sum(c.speed), ticks + speed.size());
  EXPECT_EQ(sum(c.matches), frames + sets.size());
  EXPECT_EQ(count(c.matches, InsertVerdict::kInserted), c.map_accepted() + c.map_rejected());
}

TEST(Estimator, TakesAllThatComesAtOnceAfterAStall) {
  StraightRun run;
  run.start();
  run.run(1.0, false);
  std::vector<ImuSample> imu;
  std::vector<SpeedSample> speed;
  for (double t = 1.0; t < 3.5; t += 0.05) {  // longer than the history
    imu.push_back(StraightDrive::imu(t));
    speed.push_back(run.drive.speed(t + 0.001));
  }
  const Estimate estimate = run.estimator.tick(
      StraightDrive::at(3.5), {.imu = imu, .speed = speed, .matches = {}, .initial_pose = {}});
  const Counters& c = estimate.counters;
  EXPECT_EQ(count(c.imu, InsertVerdict::kInserted) + count(c.imu, InsertVerdict::kBeforeStart),
            sum(c.imu));
  EXPECT_EQ(count(c.speed, InsertVerdict::kInserted) + count(c.speed, InsertVerdict::kBeforeStart),
            sum(c.speed));
  EXPECT_NEAR(estimate.state.p_world_imu.x(), run.drive.pose(3.5).p.x(), 0.1);
}

TEST(Estimator, CountsMatchSetsAsTheyAreJudged) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  run.drive.matches(0.95, 3, run.matches);
  const MapMatchSet* set = &run.matches;
  const Estimate estimate = run.estimator.tick(
      StraightDrive::at(1.0), {.imu = {}, .speed = {}, .matches = {&set, 1}, .initial_pose = {}});
  EXPECT_EQ(estimate.counters.map_rejected(), 1U);
  EXPECT_EQ(estimate.counters.map[static_cast<std::size_t>(MapVerdict::kTooFewMatches)], 1U);
  ASSERT_EQ(run.estimator.map_reports().size(), 1U);
  EXPECT_EQ(run.estimator.map_reports()[0].result.verdict, MapVerdict::kTooFewMatches);
  EXPECT_EQ(run.estimator.map_reports()[0].frame_time_ns, StraightDrive::at(0.95));
  run.step(false);
  EXPECT_TRUE(run.estimator.map_reports().empty());
}

TEST(Estimator, SurvivesEveryKindOfNonsense) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 20; ++i) {
    const ImuSample imu{.time_ns = StraightDrive::at(1.0 + 0.01 * i),
                        .specific_force_mps2 = {nan, nan, nan},
                        .angular_rate_radps = {nan, 0.0, 0.0}};
    const SpeedSample speed{.time_ns = imu.time_ns, .speed_mps = nan};
    run.drive.matches(0.95, 60, run.matches);
    run.matches.frame_time_ns += i;
    for (MapMatch& match : run.matches.matches) {
      match.pixel_px.x() = i % 2 == 0 ? nan : 1e300;
    }
    run.matches.nodes[0].covariance.setConstant(i % 3 == 0 ? nan : 1e-4);
    const MapMatchSet* set = &run.matches;
    const Estimate& estimate = run.estimator.tick(
        imu.time_ns,
        {.imu = {&imu, 1}, .speed = {&speed, 1}, .matches = {&set, 1}, .initial_pose = {}});
    ASSERT_TRUE(all_finite(estimate.state)) << i;
    ASSERT_TRUE(estimate.P.allFinite()) << i;
  }
}

TEST(Estimator, RestartsAtANewInitialPose) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  RigidTransform elsewhere = run.drive.pose(1.0);
  elsewhere.p.y() = 100.0;
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(1.0), .T_world_imu = elsewhere};
  const Estimate estimate = run.step(false);
  EXPECT_EQ(estimate.mode, Mode::kDeadReckoning) << "the new place needs a fix of its own";
  EXPECT_NEAR(estimate.state.p_world_imu.y(), 100.0, 1e-6);
  EXPECT_NEAR(std::sqrt(estimate.P(4, 4)), 0.3, 0.01);
}

// A new pose whose time never comes must not stop the filter that runs.
TEST(Estimator, KeepsRunningUntilTheNewPosesTime) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(1e6), .T_world_imu = run.drive.pose(0.0)};
  const Estimate estimate = run.run(1.0, true);
  EXPECT_EQ(estimate.mode, Mode::kTracking);
  EXPECT_EQ(estimate.reasons, 0U);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 8.0 * 1.99, 0.05);
}

// The computer's clock was wrong by a day at first, then set: until a pose is given on the new time
// line everything is refused and counted, then the drive goes on.
TEST(Estimator, RestartsOnANewTimeLineWhenTheClockGoesBack) {
  StraightRun run;
  run.clock_error_ns = 86'400'000'000'000;
  run.start();
  EXPECT_EQ(run.run(1.0, true).mode, Mode::kTracking);
  run.clock_error_ns = 0;
  Estimate estimate = run.run(1.0, true);
  EXPECT_EQ(estimate.mode, Mode::kDeadReckoning);
  EXPECT_EQ(estimate.reasons & reason::kNoImu, reason::kNoImu);
  EXPECT_EQ(count(estimate.counters.imu, InsertVerdict::kNotMonotonic), 100U);
  EXPECT_EQ(count(estimate.counters.speed, InsertVerdict::kTooOld), 100U);
  run.inputs.initial_pose =
      InitialPose{.time_ns = StraightDrive::at(2.0), .T_world_imu = run.drive.pose(2.0)};
  run.step(false);
  estimate = run.run(2.0, true);
  EXPECT_EQ(estimate.mode, Mode::kTracking);
  EXPECT_EQ(estimate.reasons, 0U);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 8.0 * 4.0, 0.1);
}

TEST(Estimator, ASampleOutOfOrderDoesNotStopARunningFilter) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  const ImuSample late = StraightDrive::imu(0.905);
  for (const double pose_time_s : {-1.0, 2.0}) {
    TickInputs inputs{.imu = {&late, 1}, .speed = {}, .matches = {}, .initial_pose = {}};
    if (pose_time_s > 1.0) {
      inputs.initial_pose = InitialPose{.time_ns = StraightDrive::at(pose_time_s),
                                        .T_world_imu = run.drive.pose(pose_time_s)};
    }
    const Estimate& estimate = run.estimator.tick(StraightDrive::at(1.0), inputs);
    EXPECT_EQ(estimate.mode, Mode::kTracking);
    EXPECT_NEAR(estimate.state.p_world_imu.x(), 8.0, 0.05);
  }
}

// Started with a speed of zero while it drove at 8 m/s: the speed gate refuses every true speed.
TEST(Estimator, AWrongVelocityIsDoubtedWhenEverySpeedContradicts) {
  EstimatorConfig c = config();
  c.initial.velocity_mps = 0.1;
  StraightRun run(c);
  run.drive.speed_mps = 0.0;
  run.start();
  run.step(false);
  run.drive.speed_mps = 8.0;
  Estimate estimate = run.run(1.0, false);
  EXPECT_EQ(estimate.counters.doubts, 0U);
  EXPECT_NEAR(estimate.state.v_world_imu.x(), 0.0, 0.1);
  EXPECT_EQ(estimate.counters.speed_gate_rejected, 100U);
  estimate = run.run(2.0, false);
  EXPECT_EQ(estimate.counters.doubts, 1U);
  EXPECT_NEAR(estimate.state.v_world_imu.x(), 8.0, 0.1);
}

// The map holds the velocity: it is the wheels that are wrong.
TEST(Estimator, SlippingWheelsAreNotBelievedWhileTheMapIsSeen) {
  StraightRun run;
  run.start();
  run.run(2.0, true);
  run.wheel_factor = 2.0;
  const Estimate estimate = run.run(5.0, true);
  EXPECT_EQ(estimate.counters.doubts, 0U);
  EXPECT_GT(estimate.counters.speed_gate_rejected, 450U);
  EXPECT_NEAR(estimate.state.v_world_imu.x(), 8.0, 0.2);
}

TEST(Estimator, CountsSpeedsThatItWasToldNotToUse) {
  EstimatorConfig c = config();
  c.use_speed = false;
  StraightRun run(c);
  run.start();
  EXPECT_EQ(run.run(0.5, false).counters.speed_unused, 50U);
}

// Uncertain along the diagonal: each axis alone looks better than the vehicle's place is known.
TEST(Estimator, IsLostByTheLongestAxisOfTheErrorEllipse) {
  EstimatorConfig c = config();
  const auto drive_diagonally = [&c] {
    StraightRun run(c);
    run.start();
    run.inputs.initial_pose->T_world_imu.R =
        Eigen::AngleAxisd(std::numbers::pi / 4.0, Vector3d::UnitZ()).toRotationMatrix();
    return run.run(20.0, false);
  };
  const Estimate estimate = drive_diagonally();
  const Eigen::Matrix2d P = estimate.P.block<2, 2>(error_index::kP, error_index::kP);
  ASSERT_GT(P(0, 1) * P(0, 1), 0.01 * P(0, 0) * P(1, 1)) << "the axes must be correlated";
  const double longest =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(P).eigenvalues()[1]);
  c.health.lost_position_std_m = 0.999 * longest;
  EXPECT_EQ(drive_diagonally().mode, Mode::kLost);
  c.health.lost_position_std_m = 1.001 * longest;
  EXPECT_EQ(drive_diagonally().mode, Mode::kDeadReckoning);
}

// A known defect of others: a "valid" pose with time stamp zero, or of before its data.
TEST(Estimator, NeverDatesAValidPoseBackBeforeItsData) {
  StraightRun run;
  run.start();
  run.run(1.0, true);
  for (const std::int64_t now_ns : {std::int64_t{0}, StraightDrive::at(0.2)}) {
    const Estimate& estimate = run.estimator.tick(now_ns, {});
    EXPECT_TRUE(estimate.mode == Mode::kUninitialised ||
                estimate.time_ns == StraightDrive::at(0.99));
  }
}

TEST(Estimator, EmptyTicksPredictToNow) {
  StraightRun run;
  run.start();
  run.run(2.0, true);
  const Estimate& estimate = run.estimator.tick(StraightDrive::at(2.09), {});
  EXPECT_EQ(estimate.time_ns, StraightDrive::at(2.09));
  EXPECT_NEAR(estimate.state.p_world_imu.x(), 8.0 * 2.09, 0.05);
}

TEST(Estimator, SameCallsGiveTheSameBits) {
  StraightRun a;
  StraightRun b;
  a.start();
  b.start();
  const Estimate x = a.run(3.0, true);
  const Estimate y = b.run(3.0, true);
  EXPECT_EQ(x.P, y.P);
  EXPECT_EQ(x.state.R_world_imu, y.state.R_world_imu);
  EXPECT_EQ(x.state.p_world_imu, y.state.p_world_imu);
  EXPECT_EQ(x.state.v_world_imu, y.state.v_world_imu);
}

TEST(Estimator, StandingStopsTheDrift) {
  StraightRun run;
  run.drive.speed_mps = 0.0;
  run.start();
  run.run(2.0, false);
  const Estimate estimate = run.run(60.0, false);
  EXPECT_LT(estimate.state.p_world_imu.norm(), 0.02);
  EXPECT_LT(std::sqrt(estimate.P(6, 6)), 0.02) << "one independent look a second at 0.01 m/s";
  EXPECT_LT(std::sqrt(estimate.P(3, 3)), 0.6) << "0.3 m at the start, and no growth as of a drive";
}

// One node looked at again and again: its error averages away with the logarithm of the looks only,
// to 0.1 m / sqrt((1 + 1/2 + ... + 1/30) / 2) = 0.07 m here; as noise it would be 0.018 m.
TEST(Estimator, AReusedNodeIsNotBelievedMoreAndMore) {
  StraightRun run;
  run.drive.speed_mps = 0.0;
  run.start();
  constexpr double kNodeStd_m = 0.1;
  Estimate estimate;
  for (int i = 0; i < 300; ++i) {
    const double t = 0.01 * i;
    const ImuSample imu = StraightDrive::imu(t);
    const SpeedSample speed = run.drive.speed(t);
    run.inputs.imu = {&imu, 1};
    run.inputs.speed = {&speed, 1};
    const MapMatchSet* set = &run.matches;
    if (i % 10 == 9) {
      run.drive.matches(t, 200, run.matches);
      run.matches.nodes[0].covariance.diagonal().tail<3>().setConstant(kNodeStd_m * kNodeStd_m);
      run.inputs.matches = {&set, 1};
    }
    estimate = run.estimator.tick(StraightDrive::at(t), run.inputs);
    run.inputs = {};
  }
  EXPECT_GT(estimate.counters.map_accepted(), 20U);
  for (int i = 3; i < 6; ++i) {
    EXPECT_GT(std::sqrt(estimate.P(i, i)), 0.68 * kNodeStd_m);
  }
}

TEST(Estimator, MatchSetsThatWereRefusedDoNotCountAsUsesOfTheirNode) {
  const auto std_after_fix = [](int refused) {
    StraightRun run;
    run.start();
    run.run(1.0, false);
    run.drive.matches(0.9, 60, run.matches);
    run.matches.nodes[0].covariance.diagonal().tail<3>().setConstant(0.01);
    const MapMatchSet* set = &run.matches;
    TickInputs inputs{.imu = {}, .speed = {}, .matches = {&set, 1}, .initial_pose = {}};
    run.matches.frame_time_ns -= 10'000'000'000;
    for (int i = 0; i < refused; ++i) {
      run.estimator.tick(StraightDrive::at(1.0), inputs);
    }
    run.matches.frame_time_ns += 10'000'000'000;
    const Estimate& estimate = run.estimator.tick(StraightDrive::at(1.0), inputs);
    EXPECT_EQ(count(estimate.counters.matches, InsertVerdict::kTooOld),
              static_cast<std::uint64_t>(refused));
    EXPECT_EQ(estimate.counters.map_accepted(), 1U);
    return std::sqrt(estimate.P(error_index::kP, error_index::kP));
  };
  EXPECT_EQ(std_after_fix(0), std_after_fix(5));
}

TEST(Estimator, GoesOverAFullHistoryOnceATickWhateverComesLate) {
  const StraightDrive drive;
  EstimatorConfig config;
  config.models.camera = drive.camera;
  config.history.duration_s = 20.0;
  Estimator estimator(config);
  TickInputs inputs;
  for (int i = 0; i <= 1500; ++i) {  // more than the ring holds
    const ImuSample imu = StraightDrive::imu(0.01 * i);
    const SpeedSample speed = drive.speed(0.01 * i);
    inputs = {.imu = {&imu, 1},
              .speed = {&speed, i % 10 == 0 ? 1U : 0U},
              .matches = {},
              .initial_pose = {}};
    if (i == 0) {
      inputs.initial_pose = InitialPose{.time_ns = imu.time_ns, .T_world_imu = drive.pose(0.0)};
    }
    estimator.tick(imu.time_ns, inputs);
  }
  // As many late speeds as a tick can bring, the oldest last, a full match set of long ago, and
  // inertial data besides.
  std::vector<SpeedSample> speeds;
  std::vector<ImuSample> samples;
  for (int i = 0; i < 64; ++i) {
    speeds.push_back(drive.speed(14.9 - 0.1 * i - 0.005));
    samples.push_back(StraightDrive::imu(15.0 + 0.001 * (i + 1)));
  }
  MapMatchSet set;
  drive.matches(9.003, kMaxMatches, set);
  const MapMatchSet* const late = &set;
  const std::uint64_t before = estimator.events_computed();
  const Estimate& estimate =
      estimator.tick(samples.back().time_ns,
                     {.imu = samples, .speed = speeds, .matches = {&late, 1}, .initial_pose = {}});
  const std::uint64_t work = estimator.events_computed() - before;
  EXPECT_EQ(estimate.counters.map_accepted(), 1U);
  EXPECT_EQ(count(estimate.counters.speed, InsertVerdict::kInserted), 150U + 64U);
  EXPECT_LE(work, static_cast<std::uint64_t>(config.history.capacity));
  EXPECT_GE(work, 500U);
}

}  // namespace
}  // namespace topoloc::estimation
