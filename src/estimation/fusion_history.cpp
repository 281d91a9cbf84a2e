// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/fusion_history.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::estimation {

using namespace error_index;

namespace {

/// A constant acceleration and rate that nobody measured, of the variances of the model.
void add_gap_uncertainty(const ImuGapModel& model, double dt_s, Covariance& P) {
  const double v_std = model.accel_mps2 * dt_s;
  const double p_std = 0.5 * v_std * dt_s;
  const double theta_std = model.rate_radps * dt_s;
  P.diagonal().segment<3>(kTheta).array() += theta_std * theta_std;
  P.diagonal().segment<3>(kP).array() += p_std * p_std;
  P.diagonal().segment<3>(kV).array() += v_std * v_std;
  P.block<3, 3>(kP, kV).diagonal().array() += p_std * v_std;
  P.block<3, 3>(kV, kP).diagonal().array() += p_std * v_std;
}

/// Everything that waits for an IMU sample comes in with it, and one event is always kept.
HistoryConfig with_room_for_pending(HistoryConfig config) {
  config.capacity = std::max(config.capacity, config.pending_capacity + 2);
  return config;
}

}  // namespace

const char* name(InsertVerdict verdict) {
  switch (verdict) {
    case InsertVerdict::kInserted:
      return "inserted";
    case InsertVerdict::kNotFinite:
      return "not_finite";
    case InsertVerdict::kNotMonotonic:
      return "not_monotonic";
    case InsertVerdict::kDuplicate:
      return "duplicate";
    case InsertVerdict::kTooOld:
      return "too_old";
    case InsertVerdict::kPendingFull:
      return "pending_full";
    case InsertVerdict::kImplausible:
      return "implausible";
    case InsertVerdict::kInFuture:
      return "in_future";
    case InsertVerdict::kBeforeStart:
      return "before_start";
  }
  return "unknown";
}

FusionHistory::FusionHistory(const FilterModels& models, const HistoryConfig& config)
    : models_(models),
      config_(with_room_for_pending(config)),
      map_update_(models.camera, models.map_update),
      gyro_std_radps_(models.imu.gyro_noise_density * std::sqrt(models.imu_rate_hz)),
      events_(static_cast<std::size_t>(config_.capacity)),
      states_(static_cast<std::size_t>(config_.capacity)),
      covariances_(static_cast<std::size_t>(config_.capacity), Covariance::Zero()),
      map_sets_(static_cast<std::size_t>(config.map_capacity)),
      reports_(static_cast<std::size_t>(config.map_capacity)) {
  pending_.reserve(static_cast<std::size_t>(config.pending_capacity));
  free_map_slots_.reserve(static_cast<std::size_t>(config.map_capacity));
}

void FusionHistory::reset(const ImuSample& imu, const NominalState& x, const Covariance& P) {
  clear();
  first_ = 0;
  size_ = 1;
  speeds_rejected_since_ns_.reset();
  dropped_speed_ns_.reset();
  free_map_slots_.clear();
  for (int slot = 0; slot < config_.map_capacity; ++slot) {
    free_map_slots_.push_back(slot);
  }
  events_[0] = Event{.time_ns = imu.time_ns,
                     .kind = Kind::kImu,
                     .specific_force = imu.specific_force_mps2,
                     .angular_rate = imu.angular_rate_radps};
  states_[0] = x;
  covariances_[0] = P;
}

void FusionHistory::clear() {
  forgotten_ += pending_.size();
  for (int i = 0; i < size_; ++i) {
    forgotten_ += event(i).kind == Kind::kMap && !event(i).told ? 1 : 0;
  }
  size_ = 0;
  dirty_from_ = kNone;
  report_count_ = 0;
  pending_.clear();
}

// --- What comes in -------------------------------------------------------------------------------

InsertVerdict FusionHistory::add_imu(const ImuSample& sample) {
  if (!sample.specific_force_mps2.allFinite() || !sample.angular_rate_radps.allFinite()) {
    return InsertVerdict::kNotFinite;
  }
  // Everything in the history lies at or before the newest IMU sample.
  if (sample.time_ns <= newest_time_ns()) {
    return InsertVerdict::kNotMonotonic;
  }
  const Event imu{.time_ns = sample.time_ns,
                  .kind = Kind::kImu,
                  .specific_force = sample.specific_force_mps2,
                  .angular_rate = sample.angular_rate_radps};
  // What waited for this sample takes its place before it, or after it at the same time.
  int appended = 1;
  auto waiting = pending_.begin();
  for (; waiting != pending_.end() && before(*waiting, imu); ++waiting, ++appended) {
    append(*waiting);
  }
  append(imu);
  for (; waiting != pending_.end() && waiting->time_ns == imu.time_ns; ++waiting, ++appended) {
    append(*waiting);
  }
  pending_.erase(pending_.begin(), waiting);

  const int first_new = size_ - appended;
  for (int i = first_new; i < size_; ++i) {
    interpolate_inertial(i);
  }
  touch(first_new);
  drop_expired();
  return InsertVerdict::kInserted;
}

InsertVerdict FusionHistory::add_speed(const SpeedSample& sample, bool standing) {
  if (!std::isfinite(sample.speed_mps)) {
    return InsertVerdict::kNotFinite;
  }
  return insert(Event{.time_ns = sample.time_ns,
                      .kind = standing ? Kind::kStandstill : Kind::kSpeed,
                      .speed_mps = sample.speed_mps});
}

InsertVerdict FusionHistory::add_uncertainty(std::int64_t time_ns, const AddedUncertainty& added) {
  const InsertVerdict verdict =
      insert(Event{.time_ns = time_ns, .kind = Kind::kUncertainty, .added = added});
  if (verdict == InsertVerdict::kInserted) {
    speeds_rejected_since_ns_.reset();
  }
  return verdict;
}

InsertVerdict FusionHistory::add_matches(const MapMatchSet& set) {
  if (set.match_count < 0 || set.match_count > kMaxMatches || set.matches.size() < kMaxMatches) {
    return InsertVerdict::kNotFinite;
  }
  if (set.frame_time_ns < oldest_time_ns()) {
    return InsertVerdict::kTooOld;
  }
  const int slot = take_map_slot();
  if (slot < 0) {
    return InsertVerdict::kPendingFull;
  }
  map_sets_[static_cast<std::size_t>(slot)].assign(set);
  const InsertVerdict verdict =
      insert(Event{.time_ns = set.frame_time_ns, .kind = Kind::kMap, .map_slot = slot});
  if (verdict != InsertVerdict::kInserted) {
    free_map_slots_.push_back(slot);
  }
  return verdict;
}

// --- The order of events -------------------------------------------------------------------------

int FusionHistory::rank(Kind kind) {
  // A standstill is what a speed sample became: there is one of the two at a time.
  return static_cast<int>(kind == Kind::kStandstill ? Kind::kSpeed : kind);
}

bool FusionHistory::before(const Event& a, const Event& b) {
  return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : rank(a.kind) < rank(b.kind);
}

bool FusionHistory::duplicates(const Event& a, const Event& b) {
  return a.time_ns == b.time_ns && rank(a.kind) == rank(b.kind);
}

InsertVerdict FusionHistory::insert(const Event& e) {
  if (e.time_ns > newest_time_ns()) {
    return wait_for_inertial(e);
  }
  int place = size_;
  while (place > 0 && before(e, event(place - 1))) {
    --place;
  }
  if (place > 0 && duplicates(e, event(place - 1))) {
    return InsertVerdict::kDuplicate;
  }
  if (size_ == config_.capacity) {
    drop_oldest();
    --place;
  }
  if (place <= 0) {
    return InsertVerdict::kTooOld;
  }
  ++size_;
  for (int i = size_ - 1; i > place; --i) {
    event(i) = event(i - 1);
  }
  event(place) = e;
  interpolate_inertial(place);
  touch(place);
  return InsertVerdict::kInserted;
}

InsertVerdict FusionHistory::wait_for_inertial(const Event& e) {
  // Time stamps of a wrong clock must not fill the queue for good.
  if (seconds(e.time_ns - newest_time_ns()) > config_.duration_s) {
    return InsertVerdict::kInFuture;
  }
  const auto place = std::upper_bound(pending_.begin(), pending_.end(), e, before);
  if (place != pending_.begin() && duplicates(e, *(place - 1))) {
    return InsertVerdict::kDuplicate;
  }
  if (pending_.size() == static_cast<std::size_t>(config_.pending_capacity)) {
    return InsertVerdict::kPendingFull;
  }
  pending_.insert(place, e);
  return InsertVerdict::kInserted;
}

void FusionHistory::append(const Event& e) {
  if (size_ == config_.capacity) {
    drop_oldest();
  }
  ++size_;
  event(size_ - 1) = e;
}

void FusionHistory::drop_oldest() {
  if (dirty_from_ <= 1) {
    compute_event(1);
    dirty_from_ = 2;
  }
  dirty_from_ -= dirty_from_ != kNone ? 1 : 0;
  if (rank(event(0).kind) == rank(Kind::kSpeed)) {
    dropped_speed_ns_ = event(0).time_ns;
  }
  first_ = (first_ + 1) % config_.capacity;
  --size_;
  // The new oldest event will not be applied again: the state after it is where going back ends.
  Event& oldest = event(0);
  if (oldest.map_slot >= 0) {
    free_map_slots_.push_back(oldest.map_slot);
    oldest.map_slot = -1;
  }
}

void FusionHistory::drop_expired() {
  while (size_ > 1 && seconds(newest_time_ns() - event(1).time_ns) >= config_.duration_s) {
    drop_oldest();
  }
}

int FusionHistory::take_map_slot() {
  // Short of slots, the history gets shorter instead of the newest match set being lost, unless all
  // slots wait for inertial data and shortening would not free any.
  const auto waiting = std::count_if(pending_.begin(), pending_.end(),
                                     [](const Event& e) { return e.map_slot >= 0; });
  if (waiting == config_.map_capacity) {
    return -1;
  }
  while (free_map_slots_.empty() && size_ > 1) {
    drop_oldest();
  }
  if (free_map_slots_.empty()) {
    return -1;
  }
  const int slot = free_map_slots_.back();
  free_map_slots_.pop_back();
  return slot;
}

// --- Computing the states ------------------------------------------------------------------------

void FusionHistory::interpolate_inertial(int i) {
  Event& e = event(i);
  if (e.kind == Kind::kImu) {
    return;
  }
  int previous = i - 1;
  while (previous > 0 && event(previous).kind != Kind::kImu) {
    --previous;
  }
  int next = i + 1;
  while (next < size_ && event(next).kind != Kind::kImu) {
    ++next;
  }
  const Event& a = event(previous);
  const Event at = interpolated(a, next < size_ ? event(next) : a, e.time_ns);
  e.specific_force = at.specific_force;
  e.angular_rate = at.angular_rate;
}

FusionHistory::Event FusionHistory::interpolated(const Event& a, const Event& b,
                                                 std::int64_t time_ns) {
  Event e = a;
  e.time_ns = time_ns;
  if (b.time_ns > a.time_ns) {
    const double fraction = seconds(time_ns - a.time_ns) / seconds(b.time_ns - a.time_ns);
    e.specific_force += fraction * (b.specific_force - a.specific_force);
    e.angular_rate += fraction * (b.angular_rate - a.angular_rate);
  }
  return e;
}

void FusionHistory::touch(int first) {
  dirty_from_ = std::min(dirty_from_, std::max(1, first));
  if (!held_) {
    compute_dirty();
  }
}

void FusionHistory::compute() {
  held_ = false;
  compute_dirty();
}

void FusionHistory::compute_dirty() {
  for (int i = dirty_from_; i < size_; ++i) {
    compute_event(i);
  }
  dirty_from_ = kNone;
}

void FusionHistory::compute_event(int i) {
  ++computed_;
  NominalState& x = states_[ring(i)];
  Covariance& P = covariances_[ring(i)];
  Event& e = event(i);
  x = state(i - 1);
  P = covariance(i - 1);
  propagate_between(event(i - 1), e, x, P);
  apply(i, x, P);
}

// How much of an independent sample a speed is worth: wheel slip and suspension travel last longer
// than the time since the speed before.
double FusionHistory::independent_share(int i) const {
  int previous = i - 1;
  while (previous >= 0 && rank(event(previous).kind) != rank(Kind::kSpeed)) {
    --previous;
  }
  const auto previous_ns = previous >= 0 ? event(previous).time_ns : dropped_speed_ns_;
  if (!previous_ns) {
    return 1.0;
  }
  return std::min(1.0, seconds(event(i).time_ns - *previous_ns) / models_.speed.correlation_s);
}

void FusionHistory::propagate_between(const Event& from, const Event& to, NominalState& x,
                                      Covariance& P) const {
  if (to.time_ns <= from.time_ns) {
    return;
  }
  const InertialInput u{.specific_force_mps2 = 0.5 * (from.specific_force + to.specific_force),
                        .angular_rate_radps = 0.5 * (from.angular_rate + to.angular_rate)};
  const double dt_s = seconds(to.time_ns - from.time_ns);
  const ImuNoise noise =
      with_scale_error(with_wander(models_.imu, models_.map_wander, x.v_world_imu.norm()),
                       models_.gyro_scale_std, (u.angular_rate_radps - x.gyro_bias_radps).norm());
  propagate_covariance(x, u, noise, dt_s, P);
  if (dt_s > models_.imu_gap.longer_than_s) {
    add_gap_uncertainty(models_.imu_gap, dt_s, P);
  }
  x = propagate_state(x, u, dt_s);
}

VectorVerdict FusionHistory::apply_speed(int i, NominalState& x, Covariance& P) const {
  const Event& e = event(i);
  return update_with_vector<3>(
             [&](const NominalState& x_k) {
               return linearise_speed(x_k, models_.speed, e.angular_rate, gyro_std_radps_,
                                      e.speed_mps);
             },
             models_.speed.chi2_gate, x, P, independent_share(i))
      .verdict;
}

void FusionHistory::apply(int i, NominalState& x, Covariance& P) {
  Event& e = event(i);
  VectorVerdict verdict = VectorVerdict::kAccepted;
  switch (e.kind) {
    case Kind::kImu:
      break;
    case Kind::kSpeed:
      verdict = apply_speed(i, x, P);
      break;
    case Kind::kStandstill:
      verdict = update_with_vector<6>(
                    [&](const NominalState& x_k) {
                      return linearise_standstill(x_k, models_.standstill, e.angular_rate,
                                                  independent_share(i));
                    },
                    models_.standstill.chi2_gate, x, P)
                    .verdict;
      if (verdict != VectorVerdict::kAccepted) {
        verdict = apply_speed(i, x, P);  // zero within the sensor's dead band, then
      }
      break;
    case Kind::kUncertainty:
      P.diagonal().segment<3>(kTheta).array() += e.added.theta_rad * e.added.theta_rad;
      P.diagonal().segment<3>(kP).array() += e.added.p_m * e.added.p_m;
      P.diagonal().segment<3>(kV).array() += e.added.v_mps * e.added.v_mps;
      break;
    case Kind::kMap: {
      const Eigen::Vector3d p_before = x.p_world_imu;
      const MapUpdateResult result =
          map_update_.apply(map_sets_[static_cast<std::size_t>(e.map_slot)], x, P);
      const bool accepted = result.verdict == MapVerdict::kAccepted;
      if (!e.told || accepted != (e.told_verdict == MapVerdict::kAccepted)) {
        make_report(e, (x.p_world_imu - p_before).norm(), result);
        e.told_verdict = result.verdict;
      }
      break;
    }
  }
  if (!e.told && rank(e.kind) == rank(Kind::kSpeed)) {
    note_speed(e, verdict == VectorVerdict::kAccepted);
  }
  e.told = true;
}

void FusionHistory::note_speed(const Event& e, bool accepted) {
  if (accepted) {
    speeds_rejected_since_ns_.reset();
    return;
  }
  ++speeds_rejected_;
  if (!speeds_rejected_since_ns_) {
    speeds_rejected_since_ns_ = e.time_ns;
  }
}

void FusionHistory::make_report(const Event& e, double jump_m, const MapUpdateResult& result) {
  if (static_cast<std::size_t>(report_count_) == reports_.size()) {
    return;  // the caller reads them every tick; a tick cannot apply more sets than there are slots
  }
  const MapMatchSet& set = map_sets_[static_cast<std::size_t>(e.map_slot)];
  reports_[static_cast<std::size_t>(report_count_)] = {.frame_time_ns = e.time_ns,
                                                       .revised = e.told,
                                                       .before = e.told_verdict,
                                                       .node_ids = {},
                                                       .node_count = set.node_count,
                                                       .jump_m = jump_m,
                                                       .result = result};
  MapUpdateReport& report = reports_[static_cast<std::size_t>(report_count_)];
  std::transform(set.nodes.begin(), set.nodes.begin() + set.node_count, report.node_ids.begin(),
                 [](const MatchedNode& node) { return node.node_id; });
  ++report_count_;
}

// --- What goes out -------------------------------------------------------------------------------

void FusionHistory::predict(std::int64_t time_ns, NominalState& x, Covariance& P) const {
  x = newest_state();
  P = newest_covariance();
  Event held = event(size_ - 1);
  held.time_ns = time_ns;
  propagate_between(event(size_ - 1), held, x, P);
}

std::optional<NominalState> FusionHistory::state_at(std::int64_t time_ns, Covariance& P) const {
  int i = size_ - 1;
  while (i >= 0 && event(i).time_ns > time_ns) {
    --i;
  }
  if (i < 0) {
    return std::nullopt;
  }
  NominalState x;
  if (i == size_ - 1) {
    predict(time_ns, x, P);
    return x;
  }
  x = state(i);
  P = covariance(i);
  propagate_between(event(i), interpolated(event(i), event(i + 1), time_ns), x, P);
  return x;
}

}  // namespace topoloc::estimation
