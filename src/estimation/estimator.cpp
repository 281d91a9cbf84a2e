// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/estimator.hpp"

#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace topoloc::estimation {

using namespace error_index;

namespace {

void count(std::array<std::uint64_t, kInsertVerdictCount>& counters, InsertVerdict verdict) {
  ++counters[static_cast<std::size_t>(verdict)];
}

TimeLine imu_time_line(const HealthConfig& health) {
  constexpr unsigned kSamplesToBelieve = 5;
  return TimeLine(kSamplesToBelieve,
                  static_cast<std::int64_t>(std::llround(health.max_imu_gap_s * 1e9)));
}

Covariance initial_covariance(const InitialUncertainty& u, bool velocity_known) {
  Covariance P = Covariance::Zero();
  const auto set = [&P](int at, double std) { P.diagonal().segment<3>(at).setConstant(std * std); };
  set(kTheta, u.attitude_rad);
  set(kP, u.position_m);
  set(kV, velocity_known ? u.velocity_mps : u.velocity_unknown_mps);
  set(kBa, u.accel_bias_mps2);
  set(kBg, u.gyro_bias_radps);
  set(kG, u.gravity_mps2);
  return P;
}

/// Standard deviation along the longest axis of the error ellipse.
double largest_std(const Eigen::Matrix2d& P) {
  return std::sqrt(0.5 * P.trace() + std::hypot(0.5 * (P(0, 0) - P(1, 1)), P(0, 1)));
}

}  // namespace

const char* name(Mode mode) {
  switch (mode) {
    case Mode::kUninitialised:
      return "uninitialised";
    case Mode::kTracking:
      return "tracking";
    case Mode::kDeadReckoning:
      return "dead_reckoning";
    case Mode::kLost:
      return "lost";
  }
  return "unknown";
}

EstimatorConfig without_map(EstimatorConfig config) {
  config.models.map_wander.share = 0.0;
  return config;
}

Estimator::Estimator(const EstimatorConfig& config)
    : config_(config),
      history_(config.models, config.history),
      standstill_(config.models.standstill),
      imu_time_line_(imu_time_line(config.health)),
      imu_screen_(config.imu_screen) {}

const Estimate& Estimator::tick(std::int64_t now_ns, const TickInputs& inputs) {
  report_count_ = 0;
  if (inputs.initial_pose) {
    take_initial_pose(*inputs.initial_pose);
  }
  // All that came together is computed once, so that the work of a tick has a bound: the history
  // gone over, and once more for each time the filter doubts itself.
  history_.hold();
  take_in_order(inputs.speed, inputs.imu);
  for (const MapMatchSet* set : inputs.matches) {
    take_matches(*set);
  }
  history_.compute();
  read_reports();
  doubt_velocity_if_due();
  doubt_damaged_imu();
  judge(now_ns);
  return estimate_;
}

std::span<const MapUpdateReport> Estimator::map_reports() const {
  return {reports_.data(), report_count_};
}

std::optional<NominalState> Estimator::state_at(std::int64_t time_ns, Covariance& P) const {
  return history_.empty() ? std::nullopt : history_.state_at(time_ns, P);
}

void Estimator::take_initial_pose(const InitialPose& pose) {
  const Eigen::Matrix3d& R = pose.T_world_imu.R;
  constexpr double kRotationTolerance = 1e-6;
  const bool rotation =
      (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < kRotationTolerance &&
      R.determinant() > 0.0;  // false for NaN
  if (!rotation || !pose.T_world_imu.p.allFinite()) {
    ++estimate_.counters.initial_pose_rejected;
    return;
  }
  initial_pose_ = pose;
}

bool Estimator::speed_is_of(std::int64_t time_ns) const {
  return last_speed_ && seconds(time_ns - last_speed_->time_ns) <= config_.health.speed_timeout_s;
}

void Estimator::start_if_ready() {
  if (!initial_pose_ || !last_imu_ || last_imu_->time_ns < initial_pose_->time_ns) {
    return;
  }
  if (seconds(last_imu_->time_ns - initial_pose_->time_ns) > config_.health.max_pose_age_s) {
    ++estimate_.counters.initial_pose_rejected;
    initial_pose_.reset();
    return;
  }
  if (config_.use_speed && !speed_is_of(last_imu_->time_ns)) {
    return;
  }
  // The pose may be a little older than the inertial sample: it is carried there.
  const double age_s = seconds(last_imu_->time_ns - initial_pose_->time_ns);
  const Eigen::Vector3d rate = last_imu_->angular_rate_radps - config_.initial_gyro_bias_radps;
  NominalState x;
  x.R_world_imu = initial_pose_->T_world_imu.R * so3::exp(age_s * rate);
  x.p_world_imu = initial_pose_->T_world_imu.p;
  x.accel_bias_mps2 = config_.initial_accel_bias_mps2;
  x.gyro_bias_radps = config_.initial_gyro_bias_radps;
  x.gravity_mps2 = {0.0, 0.0, -config_.gravity_mps2};
  if (config_.use_speed) {
    const SpeedModel& speed = config_.models.speed;
    const Eigen::Vector3d v_vehicle(speed.wheel_scale * last_speed_->speed_mps, 0.0, 0.0);
    x.v_world_imu = x.R_world_imu * (speed.R_vehicle_imu.transpose() * v_vehicle -
                                     rate.cross(speed.wheel_reference_imu_m));
  }
  x.p_world_imu += x.v_world_imu * age_s;
  history_.reset(*last_imu_, x, initial_covariance(config_.initial, config_.use_speed));
  ++estimate_.counters.starts;
  last_fix_ns_ = last_imu_->time_ns;
  has_fix_ = false;
  travelled_from_ = x.p_world_imu;
  estimate_.since_fix_m = 0.0;
  consecutive_rejections_ = 0;
  node_uses_.fill({});
  initial_pose_.reset();
}

// The IMU's clock was set: what was taken in by the old one says nothing about now.
void Estimator::forget_time_line() {
  history_.clear();
  standstill_ = StandstillDetector(config_.models.standstill);
  last_imu_.reset();
  last_speed_.reset();
  imu_time_line_ = imu_time_line(config_.health);
  imu_screen_ = ImuScreen(config_.imu_screen);
  imu_gap_ = false;
  const Counters counters = estimate_.counters;
  estimate_ = {};
  estimate_.counters = counters;
}

// A leap ahead is a wrong time stamp, unless the samples that follow agree with it. Steps back are
// take_imu()'s.
bool Estimator::believes_time(const ImuSample& sample) {
  if (last_imu_ && sample.time_ns <= last_imu_->time_ns) {
    return true;
  }
  const TimeLine::Verdict verdict = imu_time_line_.add(sample.time_ns);
  if (verdict == TimeLine::Verdict::kAcceptedNewLine) {
    forget_time_line();
    imu_time_line_.add(sample.time_ns);
  }
  return verdict != TimeLine::Verdict::kLeaptAhead;
}

// After a stall, a tick has the data of seconds: speeds far ahead of the inertial data would be
// refused, although what they wait for is there.
void Estimator::take_in_order(std::span<const SpeedSample> speed, std::span<const ImuSample> imu) {
  auto next = speed.begin();
  for (const ImuSample& sample : imu) {
    for (; next != speed.end() && next->time_ns <= sample.time_ns; ++next) {
      take_speed(*next);
    }
    take_imu(sample);
  }
  std::for_each(next, speed.end(), [this](const SpeedSample& sample) { take_speed(sample); });
}

void Estimator::take_imu(const ImuSample& sample) {
  const bool finite =
      sample.specific_force_mps2.allFinite() && sample.angular_rate_radps.allFinite();
  // One sample out of order must not stop a filter that runs: it takes a pose of the new time line.
  if (finite && last_imu_ && sample.time_ns < last_imu_->time_ns &&
      (history_.empty() || (initial_pose_ && initial_pose_->time_ns <= sample.time_ns))) {
    forget_time_line();
  }
  if (finite && !believes_time(sample)) {
    count(estimate_.counters.imu, InsertVerdict::kInFuture);
    return;
  }
  const bool later = !last_imu_ || sample.time_ns > last_imu_->time_ns;
  if (finite && later && !imu_screen_.believes(sample)) {
    count(estimate_.counters.imu, InsertVerdict::kImplausible);
    imu_damaged_ = true;
    return;
  }
  if (finite && last_imu_ && later) {
    imu_gap_ = seconds(sample.time_ns - last_imu_->time_ns) > config_.health.imu_timeout_s;
    estimate_.counters.imu_gaps += imu_gap_ ? 1 : 0;
  }
  if (history_.empty()) {
    if (!finite) {
      count(estimate_.counters.imu, InsertVerdict::kNotFinite);
      return;
    }
    standstill_.add_imu(sample);
    last_imu_ = sample;
    count(estimate_.counters.imu, InsertVerdict::kBeforeStart);
    start_if_ready();
    return;
  }
  const InsertVerdict verdict = history_.add_imu(sample);
  count(estimate_.counters.imu, verdict);
  if (verdict == InsertVerdict::kInserted) {
    standstill_.add_imu(sample);
    last_imu_ = sample;
    start_if_ready();  // a new initial pose restarts the filter once its time has come
  }
}

void Estimator::take_speed(const SpeedSample& sample) {
  if (!config_.use_speed) {
    ++estimate_.counters.speed_unused;
    return;
  }
  const bool later =
      std::isfinite(sample.speed_mps) && (!last_speed_ || sample.time_ns > last_speed_->time_ns);
  const bool standing = later && standstill_.add_speed(sample);
  if (history_.empty()) {
    count(estimate_.counters.speed, InsertVerdict::kBeforeStart);
    last_speed_ = later ? sample : last_speed_;
    return;
  }
  const InsertVerdict verdict = history_.add_speed(sample, standing);
  count(estimate_.counters.speed, verdict);
  if (later && verdict == InsertVerdict::kInserted) {
    last_speed_ = sample;
  }
}

void Estimator::take_matches(const MapMatchSet& set) {
  if (history_.empty()) {
    count(estimate_.counters.matches, InsertVerdict::kBeforeStart);
    return;
  }
  if (set.match_count < 0 || set.match_count > kMaxMatches || set.node_count < 0 ||
      set.node_count > kMaxMatchedNodes || set.matches.size() < kMaxMatches) {
    count(estimate_.counters.matches, InsertVerdict::kNotFinite);
    return;
  }
  scratch_.assign(set);
  inflate_for_reuse(scratch_);
  const InsertVerdict verdict = history_.add_matches(scratch_);
  count(estimate_.counters.matches, verdict);
}

void Estimator::inflate_for_reuse(MapMatchSet& set) const {
  for (int i = 0; i < set.node_count; ++i) {
    MatchedNode& node = set.nodes[static_cast<std::size_t>(i)];
    const auto* use = std::ranges::find(node_uses_, node.node_id, &NodeUse::node_id);
    const int uses = use != node_uses_.end() ? use->uses : 0;
    node.covariance *= node_reuse_factor(uses);
  }
}

void Estimator::count_uses(const MapUpdateReport& report) {
  for (int i = 0; i < report.node_count; ++i) {
    const std::uint32_t id = report.node_ids[static_cast<std::size_t>(i)];
    auto* use = std::ranges::find(node_uses_, id, &NodeUse::node_id);
    if (use == node_uses_.end()) {
      use = &node_uses_[next_node_use_];
      next_node_use_ = (next_node_use_ + 1) % node_uses_.size();
      *use = {.node_id = id, .uses = 0};
    }
    use->uses = std::min(use->uses + 1, 1000);
  }
}

void Estimator::read_reports() {
  const HealthConfig& health = config_.health;
  // By value: doubting inserts an event, which may make further reports.
  for (int i = 0; i < history_.report_count(); ++i) {
    const MapUpdateReport report = history_.report(i);
    if (report_count_ < reports_.size()) {
      reports_[report_count_++] = report;
    }
    auto& counts = estimate_.counters.map;
    ++counts[static_cast<std::size_t>(report.result.verdict)];
    counts[static_cast<std::size_t>(report.before)] -= report.revised ? 1 : 0;
    if (report.result.verdict == MapVerdict::kAccepted) {
      count_uses(report);
      consecutive_rejections_ = 0;
      last_fix_ns_ = std::max(last_fix_ns_, report.frame_time_ns);
      has_fix_ = true;
      estimate_.since_fix_m = 0.0;
      estimate_.last_jump_m = report.jump_m;
      continue;
    }
    if (report.revised) {
      continue;
    }
    const bool contradicts = report.result.verdict == MapVerdict::kTooFewInGate ||
                             report.result.verdict == MapVerdict::kInnovationTooLarge;
    consecutive_rejections_ += contradicts ? 1 : 0;
    if (consecutive_rejections_ >= health.rejections_before_doubt) {
      history_.add_uncertainty(report.frame_time_ns, {.theta_rad = health.doubt_attitude_rad,
                                                      .p_m = health.doubt_position_m});
      ++estimate_.counters.doubts;
      consecutive_rejections_ = 0;
    }
  }
  history_.clear_reports();
}

// A gate that refuses every speed would keep a wrong velocity for good. While the map holds the
// velocity it is rather the wheels that are wrong.
void Estimator::doubt_velocity_if_due() {
  if (history_.empty()) {
    return;
  }
  const HealthConfig& health = config_.health;
  const std::int64_t now_ns = history_.newest_time_ns();
  const auto since_ns = history_.speeds_rejected_since_ns();
  if (!since_ns || seconds(now_ns - *since_ns) < health.speed_doubt_after_s ||
      (has_fix_ && seconds(now_ns - last_fix_ns_) <= health.fix_timeout_s)) {
    return;
  }
  history_.add_uncertainty(now_ns, {.v_mps = health.doubt_velocity_mps});
  ++estimate_.counters.doubts;
}

void Estimator::doubt_damaged_imu() {
  if (imu_damaged_ && !history_.empty()) {
    history_.add_uncertainty(history_.newest_time_ns(),
                             {.theta_rad = config_.health.damaged_imu_attitude_rad,
                              .v_mps = config_.health.damaged_imu_velocity_mps});
  }
  imu_damaged_ = false;
}

void Estimator::judge(std::int64_t now_ns) {
  const HealthConfig& health = config_.health;
  const auto raise = [this](bool condition, std::uint32_t bit) {
    estimate_.reasons |= condition ? bit : 0U;
  };
  const bool imu_is_of_now =
      last_imu_ && std::abs(seconds(now_ns - last_imu_->time_ns)) <= health.imu_timeout_s;
  const bool has_speed = !config_.use_speed || speed_is_of(now_ns);
  estimate_.counters.forgotten = history_.forgotten();
  if (history_.empty()) {
    estimate_.time_ns = now_ns;
    estimate_.mode = Mode::kUninitialised;
    estimate_.reasons = 0;
    raise(!initial_pose_, reason::kNoPose);
    raise(!imu_is_of_now, reason::kNoImu);
    raise(!has_speed, reason::kNoSpeed);
    return;
  }
  // The state is never older than its newest event: a `now` before it must not date it back.
  now_ns = std::max(now_ns, history_.newest_time_ns());
  estimate_.time_ns = now_ns;
  history_.predict(now_ns, estimate_.state, estimate_.P);
  if (!all_finite(estimate_.state) || !estimate_.P.allFinite()) {
    // Never to be seen; if it is, nothing that follows means anything.
    ++estimate_.counters.breakdowns;
    forget_time_line();
    estimate_.time_ns = now_ns;
    raise(true, reason::kNoPose);
    return;
  }
  estimate_.counters.speed_gate_rejected = history_.speeds_rejected();
  estimate_.since_fix_s = seconds(now_ns - last_fix_ns_);
  estimate_.since_fix_m += (estimate_.state.p_world_imu - travelled_from_).norm();
  travelled_from_ = estimate_.state.p_world_imu;

  estimate_.reasons = 0;
  const double horizontal_std_m = largest_std(estimate_.P.block<2, 2>(kP, kP));
  raise(!imu_is_of_now, reason::kNoImu);
  raise(imu_gap_, reason::kImuGap);
  raise(!has_speed, reason::kNoSpeed);
  raise(!has_fix_ || estimate_.since_fix_s > health.fix_timeout_s, reason::kNoMapFix);
  raise(consecutive_rejections_ > 0, reason::kMapContradicts);
  raise(!(horizontal_std_m <= health.lost_position_std_m), reason::kUncertain);
  if ((estimate_.reasons & reason::kUncertain) != 0U) {
    estimate_.mode = Mode::kLost;
  } else if ((estimate_.reasons & (reason::kNoMapFix | reason::kNoImu)) != 0U) {
    estimate_.mode = Mode::kDeadReckoning;
  } else {
    estimate_.mode = Mode::kTracking;
  }
}

}  // namespace topoloc::estimation
