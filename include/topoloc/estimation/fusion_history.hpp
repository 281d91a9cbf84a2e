// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/map_update.hpp"
#include "topoloc/estimation/measurements.hpp"
#include "topoloc/estimation/propagation.hpp"
#include "topoloc/estimation/speed_measurement.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace topoloc::estimation {

/// What may happen between two inertial samples that are far apart, beyond what they tell: braking
/// and turning within these bounds (one standard deviation, constant over the gap).
struct ImuGapModel {
  double longer_than_s = 0.25;  ///< steps up to this are bridged by the samples alone
  double accel_mps2 = 3.0;      ///< per axis; also the centripetal one of an unseen bend
  double rate_radps = 0.3;      ///< per axis
};

/// Every model the filter uses.
struct FilterModels {
  ImuNoise imu;
  ImuGapModel imu_gap;
  double gyro_scale_std = 0.0;  ///< share of the rate by which scale and axes of the gyro are off
  MapWander map_wander;
  double imu_rate_hz = 100.0;  ///< turns the gyroscope's density into the noise of one sample
  SpeedModel speed;
  StandstillModel standstill;
  CameraModel camera;
  MapUpdateConfig map_update;
};

struct HistoryConfig {
  double duration_s = 1.0;    ///< how late a measurement may arrive
  int capacity = 1024;        ///< events kept, all sensors together
  int map_capacity = 64;      ///< match sets kept (130 kB each): enough for 30 frames/s
  int pending_capacity = 64;  ///< events that wait for inertial data to reach their time
};

enum class InsertVerdict {
  kInserted,      ///< applied, or waiting for inertial data up to its time
  kNotFinite,     ///< NaN or infinite value
  kNotMonotonic,  ///< IMU sample not later than the one before
  kDuplicate,     ///< same sensor and time as one already there
  kTooOld,        ///< before the oldest state kept
  kPendingFull,   ///< too many events wait for inertial data
  kInFuture,      ///< further ahead of the inertial data than the history is long
  kImplausible,   ///< IMU sample that no road vehicle makes (ImuScreen)
  kBeforeStart,   ///< came before the filter had started
};
inline constexpr int kInsertVerdictCount = 9;
const char* name(InsertVerdict verdict);

/// Independent uncertainty to be added to parts of the state (one standard deviation per axis).
struct AddedUncertainty {
  double theta_rad = 0.0;
  double p_m = 0.0;
  double v_mps = 0.0;
};

/// Outcome of one match set, told when it was first applied, and again if it is accepted after
/// having been rejected, or the other way round, once an earlier measurement has come in late.
struct MapUpdateReport {
  std::int64_t frame_time_ns = 0;
  bool revised = false;  ///< the set was told of before, with the other outcome:
  MapVerdict before = MapVerdict::kAccepted;
  std::array<std::uint32_t, kMaxMatchedNodes> node_ids{};
  int node_count = 0;
  double jump_m = 0.0;  ///< how far the update moved the position at the frame's time
  MapUpdateResult result;
};

/// Fusion with measurements that arrive late, at their own time (every camera filter's problem).
///
/// Keeps the last second of events (IMU samples, speeds, match sets) in the order of their time,
/// each with the state after it. An event that arrives late is put in its place and everything
/// after it is computed again, so the result depends on the events and not on when they arrived.
/// An event between two IMU samples splits their interval: the sample at its time is interpolated.
/// An event newer than the newest IMU sample waits until inertial data reaches its time.
///
/// Propagation between neighbouring events takes the mean of the two inertial values (midpoint).
/// All memory is allocated by the constructor; no function throws. Before the first reset() the
/// history is empty and nothing but reset() and empty() may be called.
class FusionHistory {
 public:
  /// A capacity that could not hold all that may be pending is raised to that.
  FusionHistory(const FilterModels& models, const HistoryConfig& config);

  /// Forgets everything and starts from a state at the time of an IMU sample.
  void reset(const ImuSample& imu, const NominalState& x, const Covariance& P);
  /// Forgets everything: empty until the next reset().
  void clear();

  /// What is added from now on is put in its place, but the states after it are not computed until
  /// compute(): once for all that comes together, instead of once for each.
  void hold() { held_ = true; }
  void compute();
  /// Events whose states were computed, again and again, since the start: the work done.
  [[nodiscard]] std::uint64_t computed() const { return computed_; }

  InsertVerdict add_imu(const ImuSample& sample);
  /// `standing`: apply the zero-velocity measurement instead of the speed.
  InsertVerdict add_speed(const SpeedSample& sample, bool standing);
  InsertVerdict add_matches(const MapMatchSet& set);
  /// Adds uncertainty after the speed and before the match set of that time is applied.
  InsertVerdict add_uncertainty(std::int64_t time_ns, const AddedUncertainty& added);

  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] std::int64_t oldest_time_ns() const { return event(0).time_ns; }
  [[nodiscard]] std::int64_t newest_time_ns() const { return event(size_ - 1).time_ns; }
  [[nodiscard]] const NominalState& newest_state() const { return state(size_ - 1); }
  [[nodiscard]] const Covariance& newest_covariance() const { return covariance(size_ - 1); }

  /// State at a later time, the newest inertial value held. Time before the newest event: that
  /// event's.
  void predict(std::int64_t time_ns, NominalState& x, Covariance& P) const;
  /// State at a time inside the history; nothing if it lies before. Later times: as predict().
  std::optional<NominalState> state_at(std::int64_t time_ns, Covariance& P) const;

  /// Reports not yet told, oldest first; `clear_reports` marks them as told.
  [[nodiscard]] int report_count() const { return report_count_; }
  [[nodiscard]] const MapUpdateReport& report(int i) const {
    return reports_[static_cast<std::size_t>(i)];
  }
  void clear_reports() { report_count_ = 0; }

  /// Events that still waited for inertial data when reset() or clear() forgot them.
  [[nodiscard]] std::uint64_t forgotten() const { return forgotten_; }
  /// Speeds whose innovation failed its gate (wheel slip, or a wrong velocity), counted once each.
  [[nodiscard]] std::uint64_t speeds_rejected() const { return speeds_rejected_; }
  /// Time of the first speed that failed its gate since one passed it, or since the last reset or
  /// added uncertainty.
  [[nodiscard]] std::optional<std::int64_t> speeds_rejected_since_ns() const {
    return speeds_rejected_since_ns_;
  }

 private:
  /// Events of one time are applied in this order.
  enum class Kind : std::uint8_t { kImu, kSpeed, kStandstill, kUncertainty, kMap };
  struct Event {
    std::int64_t time_ns = 0;
    Kind kind = Kind::kImu;
    bool told = false;  ///< its report was made
    MapVerdict told_verdict = MapVerdict::kAccepted;
    int map_slot = -1;
    double speed_mps = 0.0;                                    ///< kSpeed
    AddedUncertainty added{};                                  ///< kUncertainty
    Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();  ///< at its time, interpolated
    Eigen::Vector3d angular_rate = Eigen::Vector3d::Zero();
  };

  static int rank(Kind kind);
  static bool before(const Event& a, const Event& b);
  static bool duplicates(const Event& a, const Event& b);
  [[nodiscard]] std::size_t ring(int i) const {
    return static_cast<std::size_t>((first_ + i) % config_.capacity);
  }
  [[nodiscard]] Event& event(int i) { return events_[ring(i)]; }
  [[nodiscard]] const Event& event(int i) const { return events_[ring(i)]; }
  [[nodiscard]] const NominalState& state(int i) const { return states_[ring(i)]; }
  [[nodiscard]] const Covariance& covariance(int i) const { return covariances_[ring(i)]; }

  InsertVerdict insert(const Event& e);
  InsertVerdict wait_for_inertial(const Event& e);
  [[nodiscard]] double independent_share(int i) const;
  void append(const Event& e);
  void drop_oldest();
  void drop_expired();
  int take_map_slot();
  void interpolate_inertial(int i);
  void compute_dirty();
  void compute_event(int i);
  /// Events from here on have to be computed.
  void touch(int first);
  VectorVerdict apply_speed(int i, NominalState& x, Covariance& P) const;
  void apply(int i, NominalState& x, Covariance& P);
  void note_speed(const Event& e, bool accepted);
  void make_report(const Event& e, double jump_m, const MapUpdateResult& result);
  static Event interpolated(const Event& a, const Event& b, std::int64_t time_ns);
  void propagate_between(const Event& from, const Event& to, NominalState& x, Covariance& P) const;

  FilterModels models_;
  HistoryConfig config_;
  MapUpdate map_update_;
  double gyro_std_radps_;
  int first_ = 0;
  int size_ = 0;
  static constexpr int kNone = std::numeric_limits<int>::max();
  int dirty_from_ = kNone;  ///< first event whose state does not hold
  bool held_ = false;
  std::uint64_t computed_ = 0;
  std::vector<Event> events_;
  std::vector<NominalState> states_;
  std::vector<Covariance> covariances_;
  std::optional<std::int64_t> dropped_speed_ns_;  ///< time of the newest speed that was dropped
  std::vector<Event> pending_;                    ///< sorted; capacity reserved
  std::vector<MapMatchSet> map_sets_;
  std::vector<int> free_map_slots_;  ///< capacity reserved
  std::vector<MapUpdateReport> reports_;
  int report_count_ = 0;
  std::uint64_t forgotten_ = 0;
  std::uint64_t speeds_rejected_ = 0;
  std::optional<std::int64_t> speeds_rejected_since_ns_;
};

}  // namespace topoloc::estimation
