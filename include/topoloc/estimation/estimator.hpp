// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/fusion_history.hpp"
#include "topoloc/estimation/imu_screen.hpp"
#include "topoloc/estimation/standstill.hpp"
#include "topoloc/estimation/time_line.hpp"

#include <array>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>

namespace topoloc::estimation {

/// Uncertainty of the state when the filter starts (one standard deviation).
struct InitialUncertainty {
  double position_m = 1.0;     ///< per axis
  double attitude_rad = 0.05;  ///< per axis
  double velocity_mps = 0.5;   ///< per axis; with no wheel speed `velocity_unknown_mps`
  double velocity_unknown_mps = 10.0;
  double accel_bias_mps2 = 0.1;
  double gyro_bias_radps = 0.005;
  double gravity_mps2 = 0.02;
};

/// When the filter says how well it is doing, and when it doubts itself.
struct HealthConfig {
  double fix_timeout_s = 1.0;        ///< longer without an accepted map update: dead reckoning
  double lost_position_std_m = 5.0;  ///< horizontal standard deviation above this: lost
  double imu_timeout_s = 0.25;       ///< longer without an IMU sample is reported
  double max_imu_gap_s = 5.0;        ///< longer steps are no gap but another time line
  double speed_timeout_s = 0.5;      ///< longer without a wheel speed is reported
  double max_pose_age_s = 1.0;       ///< an initial pose older than that is not started from
  int rejections_before_doubt = 5;   ///< so many frames in a row contradict the prediction:
  double doubt_position_m = 1.0;     ///< the pose is given this much more uncertainty
  double doubt_attitude_rad = 0.03;
  double speed_doubt_after_s = 2.0;  ///< every speed contradicts for so long, and no map fix:
  double doubt_velocity_mps = 3.0;   ///< the velocity is given this much more uncertainty
  /// A tick with inertial samples that cannot be true: those that can may be damaged, too.
  double damaged_imu_attitude_rad = 0.01;
  double damaged_imu_velocity_mps = 0.3;
};

struct EstimatorConfig {
  FilterModels models;
  HistoryConfig history;
  InitialUncertainty initial;
  HealthConfig health;
  ImuScreenConfig imu_screen;
  /// Biases that the filter starts with, in the IMU frame; uncertainty from InitialUncertainty.
  Eigen::Vector3d initial_accel_bias_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d initial_gyro_bias_radps = Eigen::Vector3d::Zero();
  double gravity_mps2 = 9.81;
  bool use_speed = true;
};

/// The same for a run without a map: the filter's velocity then is that over the ground, which does
/// not wander against it.
EstimatorConfig without_map(EstimatorConfig config);

/// Where the vehicle is said to be at the start; uncertainty from InitialUncertainty.
struct InitialPose {
  std::int64_t time_ns = 0;
  RigidTransform T_world_imu;
};

/// What arrived since the last tick. Pointers stay valid for the call only.
struct TickInputs {
  std::span<const ImuSample> imu;
  std::span<const SpeedSample> speed;
  std::span<const MapMatchSet* const> matches;
  /// (Re)starts the filter, also on another time line: after the IMU's clock has gone back, data is
  /// refused until a pose is given on the new one.
  std::optional<InitialPose> initial_pose;
};

enum class Mode : std::uint8_t {
  kUninitialised,  ///< waits for an initial pose, inertial data and a wheel speed
  kTracking,       ///< recent map fix
  kDeadReckoning,  ///< no accepted map fix yet, or for fix_timeout_s, or no inertial data of now
  kLost,           ///< horizontal uncertainty above lost_position_std_m
};
const char* name(Mode mode);

/// Why the mode is not better; bits of Estimate::reasons.
namespace reason {
inline constexpr std::uint32_t kNoImu = 1U << 0;     ///< none yet, or none for imu_timeout_s
inline constexpr std::uint32_t kImuGap = 1U << 1;    ///< last step between samples too long
inline constexpr std::uint32_t kNoSpeed = 1U << 2;   ///< none yet, or none for speed_timeout_s
inline constexpr std::uint32_t kNoMapFix = 1U << 3;  ///< none accepted yet, or in fix_timeout_s
inline constexpr std::uint32_t kMapContradicts = 1U << 4;  ///< the last match sets were rejected
inline constexpr std::uint32_t kUncertain = 1U << 5;       ///< above lost_position_std_m
inline constexpr std::uint32_t kNoPose = 1U << 6;  ///< not started: waits for an initial pose
}  // namespace reason

/// Everything taken in or turned away, since the start.
struct Counters {
  std::array<std::uint64_t, kInsertVerdictCount> imu{};  ///< by InsertVerdict
  std::array<std::uint64_t, kInsertVerdictCount> speed{};
  std::array<std::uint64_t, kInsertVerdictCount> matches{};
  std::uint64_t starts = 0;                 ///< times the filter was started from a pose
  std::uint64_t forgotten = 0;              ///< data that waited when the filter was restarted
  std::uint64_t initial_pose_rejected = 0;  ///< not finite, not a rotation, or too old
  std::uint64_t speed_unused = 0;           ///< speeds that came while use_speed is off
  std::uint64_t speed_gate_rejected = 0;
  std::array<std::uint64_t, kMapVerdictCount> map{};  ///< match sets inserted, by MapVerdict
  std::uint64_t imu_gaps = 0;
  std::uint64_t breakdowns = 0;  ///< times the state was not finite and was given up
  std::uint64_t doubts = 0;      ///< times the pose or the velocity was given more uncertainty

  [[nodiscard]] std::uint64_t map_accepted() const { return map.front(); }
  [[nodiscard]] std::uint64_t map_rejected() const {
    return std::reduce(map.begin() + 1, map.end());
  }
};

/// State of now, with what is needed to judge it.
struct Estimate {
  std::int64_t time_ns = 0;  ///< of the state: the tick's `now`, or that of newer data
  Mode mode = Mode::kUninitialised;
  std::uint32_t reasons = 0;
  NominalState state;
  Covariance P = Covariance::Zero();
  double since_fix_s = 0.0;  ///< age of the last accepted map fix (frame time), or of the start
  double since_fix_m = 0.0;  ///< way travelled since
  double last_jump_m = 0.0;  ///< position step of the last accepted map fix
  Counters counters;
};

/// What the covariance of a node's pose is multiplied with when the node is used again.
///
/// Its error is the same each time, so it must not average away as noise does: the k-th use gets
/// 2 k times the covariance. What k uses bring together then is half the k-th harmonic number:
/// about one look's information for the handful of frames that a node serves.
[[nodiscard]] constexpr double node_reuse_factor(int uses_before) {
  return 2.0 * (uses_before + 1);
}

/// The estimator: takes what arrived in a tick, gives the state of now. It has no clock of its own,
/// does not allocate after construction and does not throw: the same calls give the same result.
class Estimator {
 public:
  explicit Estimator(const EstimatorConfig& config);

  const Estimate& tick(std::int64_t now_ns, const TickInputs& inputs);

  /// Outcome of the match sets that were applied in the last tick.
  [[nodiscard]] std::span<const MapUpdateReport> map_reports() const;

  [[nodiscard]] const Counters& counters() const { return estimate_.counters; }
  /// FusionHistory::computed(): a measure of the work done so far.
  [[nodiscard]] std::uint64_t events_computed() const { return history_.computed(); }

  /// State at a past or future time, for the matcher; nothing before the start or the history.
  std::optional<NominalState> state_at(std::int64_t time_ns, Covariance& P) const;

 private:
  void take_initial_pose(const InitialPose& pose);
  /// A wheel speed of about that time, or a newer one, is there.
  [[nodiscard]] bool speed_is_of(std::int64_t time_ns) const;
  void start_if_ready();
  void forget_time_line();
  [[nodiscard]] bool believes_time(const ImuSample& sample);
  void take_in_order(std::span<const SpeedSample> speed, std::span<const ImuSample> imu);
  void take_imu(const ImuSample& sample);
  void take_speed(const SpeedSample& sample);
  void take_matches(const MapMatchSet& set);
  void inflate_for_reuse(MapMatchSet& set) const;
  void count_uses(const MapUpdateReport& report);
  void read_reports();
  void doubt_velocity_if_due();
  void doubt_damaged_imu();
  void judge(std::int64_t now_ns);

  EstimatorConfig config_;
  FusionHistory history_;
  StandstillDetector standstill_;
  Estimate estimate_;
  std::optional<InitialPose> initial_pose_;
  std::optional<ImuSample> last_imu_;
  std::optional<SpeedSample> last_speed_;
  std::array<MapUpdateReport, 64> reports_{};
  std::size_t report_count_ = 0;
  MapMatchSet scratch_;  ///< match set with reuse taken into account
  /// How often the nodes used lately were used.
  struct NodeUse {
    std::optional<std::uint32_t> node_id;
    int uses = 0;
  };
  std::array<NodeUse, 16> node_uses_{};
  std::size_t next_node_use_ = 0;
  std::int64_t last_fix_ns_ = 0;  ///< of the start, if !has_fix_
  Eigen::Vector3d travelled_from_ = Eigen::Vector3d::Zero();
  TimeLine imu_time_line_;
  ImuScreen imu_screen_;
  bool imu_gap_ = false;
  bool imu_damaged_ = false;  ///< in this tick
  bool has_fix_ = false;
  int consecutive_rejections_ = 0;
};

}  // namespace topoloc::estimation
