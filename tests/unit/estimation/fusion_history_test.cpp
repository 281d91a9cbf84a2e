// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/fusion_history.hpp"

#include "support/camera_scene.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using Eigen::Vector3d;
using test::Random;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kMs = 1'000'000;

FilterModels models() {
  FilterModels m;
  m.camera = test::forward_camera();
  m.speed.wheel_reference_imu_m = {-1.0, 0.2, -0.5};
  return m;
}

/// Inertial data of a gentle drive.
ImuSample imu_at(std::int64_t time_ns) {
  const double t = static_cast<double>(time_ns - kStart_ns) * 1e-9;
  return {.time_ns = time_ns,
          .specific_force_mps2 = {0.5 * std::sin(t), 0.8 * std::cos(0.7 * t), 9.81},
          .angular_rate_radps = {0.01, -0.02 * std::sin(t), 0.1 * std::cos(0.7 * t)}};
}

NominalState initial_state() {
  NominalState x;
  x.v_world_imu = {8.0, 0.0, 0.0};
  return x;
}

Covariance initial_covariance() {
  Covariance P = 1e-4 * Covariance::Identity();
  P.diagonal().segment<3>(error_index::kP).setConstant(0.25);
  P.diagonal().segment<3>(error_index::kV).setConstant(0.04);
  return P;
}

FusionHistory started(const HistoryConfig& config = {}) {
  FusionHistory history(models(), config);
  history.reset(imu_at(kStart_ns), initial_state(), initial_covariance());
  return history;
}

HistoryConfig with_map_slots(int slots) {
  HistoryConfig config;
  config.map_capacity = slots;
  return config;
}
HistoryConfig with_capacity(int events, int pending) {
  HistoryConfig config;
  config.capacity = events;
  config.pending_capacity = pending;
  return config;
}

MapMatchSet matches_at(std::int64_t time_ns, std::uint64_t seed) {
  Random random(seed);
  NominalState truth = initial_state();
  truth.p_world_imu.x() = 8.0 * static_cast<double>(time_ns - kStart_ns) * 1e-9;
  MapMatchSet set;
  test::fill_matches(truth.T_world_imu(), models().camera, 40, 1.0, random, set);
  set.frame_time_ns = time_ns;
  return set;
}

void expect_same(const FusionHistory& a, const FusionHistory& b, double tolerance = 0.0) {
  EXPECT_EQ(a.newest_time_ns(), b.newest_time_ns());
  EXPECT_LE(boxminus(a.newest_state(), b.newest_state()).norm(), tolerance + 1e-15);
  EXPECT_LE((a.newest_covariance() - b.newest_covariance()).cwiseAbs().maxCoeff(), tolerance);
}

/// What arrives: IMU sample, speed or match set, with the time at which it does.
struct Arrival {
  std::int64_t arrives_ns;
  int kind;  // 0: IMU, 1: speed, 2: matches
  std::int64_t time_ns;
};

/// Two seconds of drive at 100 Hz, speeds at 50 Hz and frames at 10 Hz between the IMU samples.
std::vector<Arrival> drive(const std::function<std::int64_t(int kind)>& delay_ns) {
  std::vector<Arrival> arrivals;
  for (int i = 1; i <= 200; ++i) {
    arrivals.push_back({kStart_ns + i * 10 * kMs, 0, kStart_ns + i * 10 * kMs});
    if (i % 2 == 0 && i > 2) {
      const std::int64_t t = kStart_ns + i * 10 * kMs - 7 * kMs;
      arrivals.push_back({t + delay_ns(1), 1, t});
    }
    if (i % 10 == 0) {
      const std::int64_t t = kStart_ns + i * 10 * kMs - 3'333'333;
      arrivals.push_back({t + delay_ns(2), 2, t});
    }
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.arrives_ns < b.arrives_ns; });
  return arrivals;
}

void feed(FusionHistory& history, const std::vector<Arrival>& arrivals) {
  for (const Arrival& a : arrivals) {
    InsertVerdict verdict{};
    if (a.kind == 0) {
      verdict = history.add_imu(imu_at(a.time_ns));
    } else if (a.kind == 1) {
      verdict = history.add_speed({.time_ns = a.time_ns, .speed_mps = 8.0}, false);
    } else {
      verdict =
          history.add_matches(matches_at(a.time_ns, static_cast<std::uint64_t>(a.time_ns % 9973)));
    }
    ASSERT_EQ(verdict, InsertVerdict::kInserted) << a.kind << ' ' << name(verdict);
    history.clear_reports();
  }
}

TEST(FusionHistory, DelayedEqualsZeroDelay) {
  FusionHistory reference = started();
  feed(reference, drive([](int) { return 0; }));
  EXPECT_LT(reference.newest_covariance()(3, 3), 0.5 * started().newest_covariance()(3, 3))
      << "the match sets must have been used";
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    FusionHistory delayed = started();
    auto arrivals = drive([&](int kind) {
      // Match sets up to 0.95 s late and overtaking one another, speeds up to 0.2 s.
      return static_cast<std::int64_t>(random.uniform() * (kind == 2 ? 950.0 : 200.0) * kMs);
    });
    feed(delayed, arrivals);
    expect_same(delayed, reference, 1e-9);
  }
}

// Inertial values that are linear in time: a run with a true sample at the frame's time must agree.
TEST(FusionHistory, FrameBetweenImuSamplesSplitsTheInterval) {
  const auto linear = [](std::int64_t time_ns) {
    const double t = static_cast<double>(time_ns - kStart_ns) * 1e-9;
    return ImuSample{.time_ns = time_ns,
                     .specific_force_mps2 = {2.0 * t, -1.0 + 5.0 * t, 9.81},
                     .angular_rate_radps = {0.1 * t, 0.0, 0.2 - t}};
  };
  const std::int64_t frame_ns = kStart_ns + 53 * kMs;
  FusionHistory split(models(), {});
  FusionHistory sampled(models(), {});
  split.reset(linear(kStart_ns), initial_state(), initial_covariance());
  sampled.reset(linear(kStart_ns), initial_state(), initial_covariance());
  for (int i = 1; i <= 10; ++i) {
    const std::int64_t t = kStart_ns + i * 10 * kMs;
    if (i == 6) {
      ASSERT_EQ(sampled.add_imu(linear(frame_ns)), InsertVerdict::kInserted);
    }
    ASSERT_EQ(split.add_imu(linear(t)), InsertVerdict::kInserted);
    ASSERT_EQ(sampled.add_imu(linear(t)), InsertVerdict::kInserted);
  }
  const MapMatchSet set = matches_at(frame_ns, 5);
  ASSERT_EQ(split.add_matches(set), InsertVerdict::kInserted);
  ASSERT_EQ(sampled.add_matches(set), InsertVerdict::kInserted);
  ASSERT_EQ(split.report_count(), 1);
  EXPECT_EQ(split.report(0).result.verdict, MapVerdict::kAccepted);
  expect_same(split, sampled, 1e-12);
}

TEST(FusionHistory, StateInsideAnIntervalIsTheOneAnEventThereWouldSee) {
  FusionHistory history = started();
  for (int i = 1; i <= 20; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  const std::int64_t t = kStart_ns + 104 * kMs;
  Covariance P_before;
  const auto before = history.state_at(t, P_before);
  ASSERT_TRUE(before);
  // an event that changes nothing
  ASSERT_EQ(history.add_uncertainty(t, {}), InsertVerdict::kInserted);
  Covariance P_after;
  const auto after = history.state_at(t, P_after);
  EXPECT_LT(boxminus(*before, *after).norm(), 1e-14);
  EXPECT_LT((P_before - P_after).norm(), 1e-14);
}

TEST(FusionHistory, StateAtReachesFromTheOldestEventIntoTheFuture) {
  FusionHistory history = started();
  for (int i = 1; i <= 20; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  Covariance P;
  EXPECT_FALSE(history.state_at(kStart_ns - 1, P));
  EXPECT_EQ(history.state_at(kStart_ns, P)->p_world_imu, initial_state().p_world_imu);
  EXPECT_EQ(history.state_at(history.newest_time_ns(), P)->p_world_imu,
            history.newest_state().p_world_imu);
  const auto future = history.state_at(history.newest_time_ns() + 100 * kMs, P);
  EXPECT_NEAR((future->p_world_imu - history.newest_state().p_world_imu).norm(), 0.8, 0.02);
  EXPECT_GT(P(3, 3), history.newest_covariance()(3, 3));
  NominalState predicted;
  Covariance P_predicted;
  history.predict(history.newest_time_ns() + 100 * kMs, predicted, P_predicted);
  EXPECT_EQ(predicted.p_world_imu, future->p_world_imu);
  EXPECT_EQ(P_predicted, P);
}

TEST(FusionHistory, EventsOlderThanTheRingAreRefused) {
  FusionHistory history = started();
  for (int i = 1; i <= 300; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + 1900 * kMs, .speed_mps = 8.0}, false),
            InsertVerdict::kTooOld);
  EXPECT_EQ(history.add_matches(matches_at(kStart_ns + 1900 * kMs, 1)), InsertVerdict::kTooOld);
  EXPECT_EQ(history.add_uncertainty(kStart_ns, {.p_m = 0.1}), InsertVerdict::kTooOld);
  EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + 2001 * kMs, .speed_mps = 8.0}, false),
            InsertVerdict::kInserted)
      << "0.999 s late";
}

TEST(FusionHistory, DuplicatesAreRefused) {
  FusionHistory history = started();
  for (int i = 1; i <= 10; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  for (const std::int64_t t : {kStart_ns + 50 * kMs, kStart_ns + 200 * kMs}) {  // ring and pending
    const SpeedSample speed{.time_ns = t, .speed_mps = 8.0};
    EXPECT_EQ(history.add_speed(speed, false), InsertVerdict::kInserted);
    EXPECT_EQ(history.add_speed(speed, false), InsertVerdict::kDuplicate);
    EXPECT_EQ(history.add_speed(speed, true), InsertVerdict::kDuplicate);
    EXPECT_EQ(history.add_matches(matches_at(t, 1)), InsertVerdict::kInserted);
    EXPECT_EQ(history.add_matches(matches_at(t, 2)), InsertVerdict::kDuplicate);
  }
}

TEST(FusionHistory, SpeedAfterAStandstillOfTheSameTimeIsADuplicate) {
  FusionHistory history = started();
  for (int i = 1; i <= 10; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  for (const std::int64_t t : {kStart_ns + 50 * kMs, kStart_ns + 200 * kMs}) {
    const SpeedSample speed{.time_ns = t, .speed_mps = 0.0};
    EXPECT_EQ(history.add_speed(speed, true), InsertVerdict::kInserted);
    EXPECT_EQ(history.add_speed(speed, false), InsertVerdict::kDuplicate);
  }
}

TEST(FusionHistory, ImuThatGoesBackwardsOrRepeatsIsRefused) {
  FusionHistory history = started();
  EXPECT_EQ(history.add_imu(imu_at(kStart_ns + 10 * kMs)), InsertVerdict::kInserted);
  const Covariance P = history.newest_covariance();
  EXPECT_EQ(history.add_imu(imu_at(kStart_ns + 10 * kMs)), InsertVerdict::kNotMonotonic);
  EXPECT_EQ(history.add_imu(imu_at(kStart_ns + 5 * kMs)), InsertVerdict::kNotMonotonic);
  EXPECT_EQ(history.newest_covariance(), P);
}

TEST(FusionHistory, NanIsRefusedAndLeavesNoTrace) {
  FusionHistory history = started();
  history.add_imu(imu_at(kStart_ns + 10 * kMs));
  const int size = history.size();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ImuSample imu = imu_at(kStart_ns + 20 * kMs);
  imu.angular_rate_radps.y() = nan;
  EXPECT_EQ(history.add_imu(imu), InsertVerdict::kNotFinite);
  EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + 5 * kMs, .speed_mps = nan}, false),
            InsertVerdict::kNotFinite);
  MapMatchSet set = matches_at(kStart_ns + 5 * kMs, 1);
  set.match_count = kMaxMatches + 1;
  EXPECT_EQ(history.add_matches(set), InsertVerdict::kNotFinite);
  set.match_count = -1;
  EXPECT_EQ(history.add_matches(set), InsertVerdict::kNotFinite);
  EXPECT_EQ(history.size(), size);
}

TEST(FusionHistory, PendingOverflowIsCountedAndTheRestStillWorks) {
  FusionHistory history = started();
  int full = 0;
  for (int i = 1; i <= 100; ++i) {
    const SpeedSample speed{.time_ns = kStart_ns + i * kMs, .speed_mps = 8.0};
    full += history.add_speed(speed, false) == InsertVerdict::kPendingFull;
  }
  EXPECT_EQ(full, 100 - HistoryConfig{}.pending_capacity);
  EXPECT_EQ(history.add_imu(imu_at(kStart_ns + 100 * kMs)), InsertVerdict::kInserted);
  EXPECT_EQ(history.size(), 2 + HistoryConfig{}.pending_capacity);
  EXPECT_TRUE(all_finite(history.newest_state()));
}

// Sensors whose clock is an hour ahead must not fill the queue for good.
TEST(FusionHistory, EventsFarInTheFutureDoNotBlockTheOthers) {
  FusionHistory history = started();
  const std::int64_t hour_ns = 3'600'000 * kMs;
  for (int i = 1; i <= 100; ++i) {
    EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + hour_ns + i, .speed_mps = 8.0}, false),
              InsertVerdict::kInFuture);
    EXPECT_EQ(history.add_matches(matches_at(kStart_ns + hour_ns + i, 1)),
              InsertVerdict::kInFuture);
  }
  EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + 5 * kMs, .speed_mps = 8.0}, false),
            InsertVerdict::kInserted);
  EXPECT_EQ(history.add_matches(matches_at(kStart_ns + 5 * kMs, 1)), InsertVerdict::kInserted);
}

TEST(FusionHistory, ShortOfSlotsTheHistoryGetsShorterAndTheNewestSetIsUsed) {
  FusionHistory history = started(with_map_slots(4));
  for (int i = 1; i <= 50; ++i) {
    const std::int64_t t = kStart_ns + i * 10 * kMs;
    ASSERT_EQ(history.add_imu(imu_at(t)), InsertVerdict::kInserted);
    ASSERT_EQ(history.add_matches(matches_at(t, static_cast<std::uint64_t>(i))),
              InsertVerdict::kInserted);
    ASSERT_EQ(history.report_count(), 1) << i;
    EXPECT_EQ(history.report(0).frame_time_ns, t);
    history.clear_reports();
  }
  EXPECT_LT(history.size(), 12);
  EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + 400 * kMs, .speed_mps = 8.0}, false),
            InsertVerdict::kTooOld);
}

// Sets that all wait for inertial data hold every slot: giving up the past would not free one.
TEST(FusionHistory, WaitingMatchSetsDoNotCostTheHistory) {
  FusionHistory history = started(with_map_slots(4));
  for (int i = 1; i <= 50; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  for (int i = 1; i <= 4; ++i) {
    EXPECT_EQ(history.add_matches(matches_at(kStart_ns + (500 + i) * kMs, 1)),
              InsertVerdict::kInserted);
  }
  EXPECT_EQ(history.add_matches(matches_at(kStart_ns + 505 * kMs, 1)), InsertVerdict::kPendingFull);
  EXPECT_EQ(history.size(), 51);
}

TEST(FusionHistory, CapacityOverflowShortensTheHistory) {
  FusionHistory small = started(with_capacity(100, 64));
  FusionHistory large = started();
  for (int i = 1; i <= 500; ++i) {
    const std::int64_t t = kStart_ns + i * 2 * kMs;
    ASSERT_EQ(small.add_imu(imu_at(t)), InsertVerdict::kInserted);
    large.add_imu(imu_at(t));
  }
  EXPECT_EQ(small.size(), 100);
  expect_same(small, large);
  const SpeedSample late{.time_ns = kStart_ns + 901 * kMs, .speed_mps = 8.0};
  EXPECT_EQ(small.add_speed(late, false), InsertVerdict::kInserted);
  large.add_speed(late, false);
  EXPECT_EQ(small.size(), 100);
  expect_same(small, large);
}

TEST(FusionHistory, CapacityIsRaisedToHoldAllThatMayWait) {
  FusionHistory history = started(with_capacity(1, 8));
  for (int i = 1; i <= 8; ++i) {
    EXPECT_EQ(history.add_speed({.time_ns = kStart_ns + i * kMs, .speed_mps = 8.0}, false),
              InsertVerdict::kInserted);
  }
  EXPECT_EQ(history.add_imu(imu_at(kStart_ns + 10 * kMs)), InsertVerdict::kInserted);
  EXPECT_EQ(history.size(), 10);
  EXPECT_TRUE(all_finite(history.newest_state()));
}

TEST(FusionHistory, EachMatchSetIsReportedOnceUnlessItsOutcomeChanges) {
  FusionHistory history = started();
  for (int i = 1; i <= 20; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  history.add_matches(matches_at(kStart_ns + 155 * kMs, 1));
  ASSERT_EQ(history.report_count(), 1);
  EXPECT_GT(history.report(0).jump_m, 0.0);
  EXPECT_EQ(history.report(0).node_ids[0], 7U);
  history.clear_reports();
  history.add_matches(matches_at(kStart_ns + 145 * kMs, 2));  // the first is computed again
  ASSERT_EQ(history.report_count(), 1);
  EXPECT_EQ(history.report(0).frame_time_ns, kStart_ns + 145 * kMs);
  history.clear_reports();
  // The vehicle has turned since: with this set the two later ones are out of the gate.
  history.add_matches(matches_at(kStart_ns + 25 * kMs, 3));
  ASSERT_EQ(history.report_count(), 3);
  EXPECT_FALSE(history.report(0).revised);
  for (const int i : {1, 2}) {
    EXPECT_TRUE(history.report(i).revised);
    EXPECT_NE(history.report(i).result.verdict, MapVerdict::kAccepted);
  }
}

TEST(FusionHistory, AMapThatWandersMakesTheVelocityLessCertain) {
  const auto velocity_variance = [](double share) {
    FilterModels m = models();
    m.map_wander = {.share = share, .length_m = 16.0};
    FusionHistory history(m, {});
    history.reset(imu_at(kStart_ns), initial_state(), initial_covariance());
    for (int i = 1; i <= 10; ++i) {
      history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
    }
    return history.newest_covariance()(error_index::kV, error_index::kV);
  };
  // At 8 m/s a drift of 0.16 m/s changes within 2 s: 0.16^2 (m/s)^2 more after 1 s, a tenth here.
  EXPECT_NEAR(velocity_variance(0.02) - velocity_variance(0.0), 0.1 * 0.16 * 0.16, 1e-4);
}

TEST(FusionHistory, AClockThatStartsAtZeroLosesNoSpeed) {
  FusionHistory history(models(), {});
  const auto imu = [](std::int64_t time_ns) {
    ImuSample sample = imu_at(kStart_ns + time_ns);
    sample.time_ns = time_ns;
    return sample;
  };
  history.reset(imu(0), initial_state(), initial_covariance());
  history.add_speed({.time_ns = 0, .speed_mps = 8.0}, false);
  EXPECT_LT(history.newest_covariance()(6, 6), 0.5 * initial_covariance()(6, 6));
}

TEST(FusionHistory, CountsWhatItForgetsWhenItIsRestarted) {
  FusionHistory history = started();
  history.add_speed({.time_ns = kStart_ns + 5 * kMs, .speed_mps = 8.0}, false);
  history.add_matches(matches_at(kStart_ns + 6 * kMs, 1));
  history.reset(imu_at(kStart_ns + 4 * kMs), initial_state(), initial_covariance());
  EXPECT_EQ(history.forgotten(), 2U);
}

TEST(FusionHistory, SlippingWheelsAreCountedOnceEach) {
  FusionHistory history = started();
  for (int i = 1; i <= 20; ++i) {
    history.add_imu(imu_at(kStart_ns + i * 10 * kMs));
  }
  history.add_speed({.time_ns = kStart_ns + 100 * kMs, .speed_mps = 50.0}, false);
  history.add_matches(matches_at(kStart_ns + 55 * kMs, 2));
  EXPECT_EQ(history.speeds_rejected(), 1U);
}

}  // namespace
}  // namespace topoloc::estimation
