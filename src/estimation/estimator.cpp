// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/estimator.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace topoloc::estimation {

using namespace error_index;

namespace {

double seconds(std::int64_t duration_ns) { return static_cast<double>(duration_ns) * 1e-9; }

void count(std::array<std::uint64_t, kInsertVerdictCount>& counters, InsertVerdict verdict) {
  ++counters[static_cast<std::size_t>(verdict)];
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

Estimator::Estimator(const EstimatorConfig& config)
    : config_(config),
      history_(config.models, config.history),
      standstill_(config.models.standstill) {}

const Estimate& Estimator::tick(std::int64_t now_ns, const TickInputs& inputs) {
  report_count_ = 0;
  if (inputs.initial_pose) {
    take_initial_pose(*inputs.initial_pose);
  }
  // Speeds first: they wait for the inertial data of this tick, so that nothing is computed twice.
  for (const SpeedSample& sample : inputs.speed) {
    take_speed(sample);
  }
  for (const ImuSample& sample : inputs.imu) {
    take_imu(sample);
  }
  for (const MapMatchSet* set : inputs.matches) {
    take_matches(*set);
  }
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

void Estimator::start_if_ready() {
  if (!initial_pose_ || !last_imu_ || (config_.use_speed && !last_speed_) ||
      last_imu_->time_ns < initial_pose_->time_ns) {
    return;
  }
  NominalState x;
  x.R_world_imu = initial_pose_->T_world_imu.R;
  x.p_world_imu = initial_pose_->T_world_imu.p;
  x.accel_bias_mps2 = config_.initial_accel_bias_mps2;
  x.gyro_bias_radps = config_.initial_gyro_bias_radps;
  x.gravity_mps2 = {0.0, 0.0, -config_.gravity_mps2};
  if (config_.use_speed) {
    const SpeedModel& speed = config_.models.speed;
    const Eigen::Vector3d v_vehicle(speed.wheel_scale * last_speed_->speed_mps, 0.0, 0.0);
    const Eigen::Vector3d rate = last_imu_->angular_rate_radps - x.gyro_bias_radps;
    x.v_world_imu = x.R_world_imu * (speed.R_vehicle_imu.transpose() * v_vehicle -
                                     rate.cross(speed.wheel_reference_imu_m));
  }
  // The pose may be a little older than the first inertial sample.
  x.p_world_imu += x.v_world_imu * seconds(last_imu_->time_ns - initial_pose_->time_ns);
  history_.reset(*last_imu_, x, initial_covariance(config_.initial, config_.use_speed));
  last_fix_ns_ = last_imu_->time_ns;
  travelled_from_ = x.p_world_imu;
  estimate_.since_fix_m = 0.0;
  consecutive_rejections_ = 0;
  node_uses_.fill({});
  initial_pose_.reset();
}

void Estimator::take_imu(const ImuSample& sample) {
  const bool finite =
      sample.specific_force_mps2.allFinite() && sample.angular_rate_radps.allFinite();
  if (finite && last_imu_ && sample.time_ns > last_imu_->time_ns) {
    imu_gap_ = seconds(sample.time_ns - last_imu_->time_ns) > config_.health.max_imu_gap_s;
    estimate_.counters.imu_gaps += imu_gap_ ? 1 : 0;
  }
  if (history_.empty()) {
    if (!finite) {
      count(estimate_.counters.imu, InsertVerdict::kNotFinite);
      return;
    }
    standstill_.add_imu(sample);
    last_imu_ = sample;
    ++estimate_.counters.before_start;
    start_if_ready();
    return;
  }
  const InsertVerdict verdict = history_.add_imu(sample);
  count(estimate_.counters.imu, verdict);
  if (verdict == InsertVerdict::kInserted) {
    standstill_.add_imu(sample);
    last_imu_ = sample;
    read_reports();
    start_if_ready();  // a new initial pose restarts the filter once its time has come
  }
}

void Estimator::take_speed(const SpeedSample& sample) {
  if (!config_.use_speed) {
    return;
  }
  const bool later =
      std::isfinite(sample.speed_mps) && (!last_speed_ || sample.time_ns > last_speed_->time_ns);
  const bool standing = later && standstill_.add_speed(sample);
  if (history_.empty()) {
    ++estimate_.counters.before_start;
    last_speed_ = later ? sample : last_speed_;
    return;
  }
  const InsertVerdict verdict = history_.add_speed(sample, standing);
  count(estimate_.counters.speed, verdict);
  if (later && verdict == InsertVerdict::kInserted) {
    last_speed_ = sample;
  }
  read_reports();
}

void Estimator::take_matches(const MapMatchSet& set) {
  if (history_.empty()) {
    ++estimate_.counters.before_start;
    return;
  }
  if (set.match_count < 0 || set.match_count > kMaxMatches || set.node_count < 0 ||
      set.node_count > kMaxMatchedNodes || set.matches.size() < kMaxMatches) {
    count(estimate_.counters.matches, InsertVerdict::kNotFinite);
    return;
  }
  scratch_.assign(set);
  inflate_for_reuse(scratch_);
  count(estimate_.counters.matches, history_.add_matches(scratch_));
  read_reports();
}

// A node's pose error is the same each time the node is used, so it must not average away: the k-th
// use gets k (k + 1) times the covariance. Since the sum over k of 1 / (k (k + 1)) is 1, all uses
// together bring no more information than one look at a node of the stated covariance.
void Estimator::inflate_for_reuse(MapMatchSet& set) {
  for (int i = 0; i < set.node_count; ++i) {
    MatchedNode& node = set.nodes[static_cast<std::size_t>(i)];
    auto use = std::find_if(node_uses_.begin(), node_uses_.end(), [&](const NodeUse& u) {
      return u.uses > 0 && u.node_id == node.node_id;
    });
    if (use == node_uses_.end()) {
      use = node_uses_.begin() + static_cast<std::ptrdiff_t>(next_node_use_);
      next_node_use_ = (next_node_use_ + 1) % node_uses_.size();
      *use = {.node_id = node.node_id, .uses = 0};
    }
    use->uses = std::min(use->uses + 1, 1000);
    node.covariance *= static_cast<double>(use->uses) * (use->uses + 1);
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
    if (report.result.verdict == MapVerdict::kAccepted) {
      ++estimate_.counters.map_accepted;
      consecutive_rejections_ = 0;
      last_fix_ns_ = std::max(last_fix_ns_, report.frame_time_ns);
      estimate_.since_fix_m = 0.0;
      estimate_.last_jump_m = report.jump_m;
      continue;
    }
    ++estimate_.counters.map_rejected;
    const bool contradicts = report.result.verdict == MapVerdict::kTooFewInGate ||
                             report.result.verdict == MapVerdict::kInnovationTooLarge;
    consecutive_rejections_ += contradicts ? 1 : 0;
    if (consecutive_rejections_ >= health.rejections_before_doubt) {
      history_.add_pose_uncertainty(report.frame_time_ns, health.doubt_attitude_rad,
                                    health.doubt_position_m);
      ++estimate_.counters.doubts;
      consecutive_rejections_ = 0;
    }
  }
  history_.clear_reports();
}

void Estimator::judge(std::int64_t now_ns) {
  if (history_.empty()) {
    estimate_.time_ns = now_ns;
    estimate_.mode = Mode::kUninitialised;
    return;
  }
  // The state is never older than its newest event: a `now` before it must not date it back.
  now_ns = std::max(now_ns, history_.newest_time_ns());
  estimate_.time_ns = now_ns;
  history_.predict(now_ns, estimate_.state, estimate_.P);
  estimate_.counters.speed_gate_rejected = history_.speeds_rejected();
  estimate_.since_fix_s = seconds(now_ns - last_fix_ns_);
  estimate_.since_fix_m += (estimate_.state.p_world_imu - travelled_from_).norm();
  travelled_from_ = estimate_.state.p_world_imu;

  const HealthConfig& health = config_.health;
  std::uint32_t reasons = 0;
  const auto raise = [&reasons](bool condition, std::uint32_t bit) {
    reasons |= condition ? bit : 0U;
  };
  const double horizontal_std_m =
      std::sqrt(std::max(estimate_.P(kP, kP), estimate_.P(kP + 1, kP + 1)));
  raise(seconds(now_ns - last_imu_->time_ns) > health.max_imu_gap_s, reason::kNoImu);
  raise(imu_gap_, reason::kImuGap);
  raise(config_.use_speed && seconds(now_ns - last_speed_->time_ns) > health.speed_timeout_s,
        reason::kNoSpeed);
  raise(estimate_.since_fix_s > health.fix_timeout_s, reason::kNoMapFix);
  raise(consecutive_rejections_ > 0, reason::kMapContradicts);
  raise(!(horizontal_std_m <= health.lost_position_std_m), reason::kUncertain);
  estimate_.reasons = reasons;
  if ((reasons & reason::kUncertain) != 0U) {
    estimate_.mode = Mode::kLost;
  } else if ((reasons & reason::kNoMapFix) != 0U) {
    estimate_.mode = Mode::kDeadReckoning;
  } else {
    estimate_.mode = Mode::kTracking;
  }
}

}  // namespace topoloc::estimation
