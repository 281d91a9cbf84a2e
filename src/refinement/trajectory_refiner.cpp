// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "topoloc/matching/map_matcher.hpp"
#include "topoloc/matching/undistorter.hpp"

#include "refinement/parallel_for.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <atomic>
#include <ctime>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

namespace topoloc::refinement {
namespace {

constexpr std::int64_t kMaxPoseGap_ns = 500'000'000;

struct Keyframe {
  std::size_t frame = 0;
  std::int64_t time_ns = 0;
  RigidTransform T_odometry;  // of dead reckoning: only differences mean something
};

/// What a pass computes of a keyframe, as long as it is needed.
struct Look {
  cv::Mat image;
  RigidTransform T_world_cam;  // where the cloud was rendered
  std::vector<SurfacePoint> points;
  ViewCorrelation correlation;
};

PinholeCamera refinement_camera(const matching::MatchingConfig& config, double scale) {
  PinholeCamera camera = matching::matching_camera(config);
  camera.width_px = static_cast<int>(std::lround(camera.width_px * scale));
  camera.height_px = static_cast<int>(std::lround(camera.height_px * scale));
  camera.fx_px *= scale;
  camera.fy_px *= scale;
  camera.cx_px = 0.5 * (camera.width_px - 1);
  camera.cy_px = 0.5 * (camera.height_px - 1);
  return camera;
}

inline double clock_s(){timespec t; clock_gettime(CLOCK_THREAD_CPUTIME_ID,&t); return double(t.tv_sec)+1e-9*double(t.tv_nsec);}
/// One run over a drive.
class Run {
 public:
  Run(const drive::Drive& drive, const PoseKnowledge& knowledge, const RefinementConfig& config,
      const mapping::CloudGrid& grid, drive::FrameLog& frames)
      : drive_(drive),
        knowledge_(knowledge),
        config_(config),
        grid_(grid),
        frames_(frames),
        camera_(refinement_camera(drive.vehicle.matching, config.camera_scale)),
        T_imu_cam_(drive.vehicle.camera.kalibr.T_imu_cam),
        undistorter_(drive.vehicle.camera.kalibr.calibration, camera_),
        mask_(undistorter_.mask(drive::read_mask(drive.vehicle.camera), 2)) {}

  std::vector<mapping::RefinedPose> run(const mapping::Progress& progress) {
    choose_keyframes();
    start();
    const int passes = 1 + config_.window.fine_passes;
    first_pass([&](double share) { report(progress, share / passes); });
    for (int pass = 1; pass < passes; ++pass) {
      fine_pass([&](double share) { report(progress, (pass + share) / passes); });
    }
    stat("lastsolve"); auto r=judge(); stat("judge"); for(auto&[k,v]:times_) std::fprintf(stderr,"TIME %s %.1f\n",k.c_str(),v); return r;
  }

 private:
  static void report(const mapping::Progress& progress, double share) {
    if (progress) {
      progress(share);
    }
  }

  void choose_keyframes() {
    const evaluation::Trajectory odometry = reckon();
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (config_.use_frame != nullptr && !config_.use_frame(i)) {
        continue;
      }
      const std::int64_t time_ns = frames_.time_ns(i);
      const auto T = evaluation::pose_at(odometry, time_ns, kMaxPoseGap_ns);
      if (!T || (knowledge_.trajectory &&
                 !evaluation::pose_at(*knowledge_.trajectory, time_ns, kMaxPoseGap_ns))) {
        continue;
      }
      if (keyframes_.empty() ||
          (T->p - keyframes_.back().T_odometry.p).norm() >= config_.keyframe_m) {
        keyframes_.push_back({i, time_ns, *T});
      }
    }
    if (keyframes_.empty()) {
      throw std::runtime_error(drive_.dir.string() +
                               ": no frame has both odometry and a pose to start from");
    }
  }

  evaluation::Trajectory reckon() const {
    if (knowledge_.initial_pose) {
      return dead_reckon(drive_, 0.0, *knowledge_.initial_pose);
    }
    const evaluation::StampedPose& first = knowledge_.trajectory->front();
    const double start_s = std::max(
        0.0, 1e-9 * static_cast<double>(first.time_ns - drive_.imu.front().time_ns));
    return dead_reckon(drive_, start_s, first.T_world_imu);
  }

  /// Odometry and priors; first poses.
  void start() {
    Vector6 std;
    std << Eigen::Vector3d::Constant(config_.prior_std_rad),
        Eigen::Vector3d::Constant(config_.prior_std_m);
    poses_.resize(keyframes_.size());
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      poses_[i] = keyframes_[i].T_odometry;
      if (i > 0) {
        const RigidTransform T = step(i);
        const double seconds =
            1e-9 * static_cast<double>(keyframes_[i].time_ns - keyframes_[i - 1].time_ns);
        graph_.odometry.push_back(
            {i - 1, i, T, seconds, motion_std(T, seconds, config_.odometry)});
      }
      graph_.gravity.push_back({i, keyframes_[i].T_odometry.R.row(2).transpose(),
                                sharing() * config_.gravity_std_rad});
      if (knowledge_.trajectory) {
        const RigidTransform prior = *evaluation::pose_at(*knowledge_.trajectory,
                                                          keyframes_[i].time_ns, kMaxPoseGap_ns);
        poses_[i] = prior;
        graph_.priors.push_back({i, prior, sharing() * std});
      }
    }
    if (knowledge_.trajectory) {
      find_ground(0, keyframes_.size());
      solve(graph_, T_imu_cam_, camera_, 0, config_.solver, poses_);
    } else {
      graph_.priors.push_back({0, poses_[0], std});
    }
  }

  [[nodiscard]] RigidTransform step(std::size_t to) const {
    return keyframes_[to - 1].T_odometry.inverse() * keyframes_[to].T_odometry;
  }

  [[nodiscard]] bool is_view(std::size_t keyframe) const {
    return keyframe % config_.window.view_every == 0;
  }

  /// Renders and correlates keyframes [begin, end) at their poses.
  void look(std::size_t begin, std::size_t end, int shrink) {
    std::array<std::atomic<double>,6> tt{}; parallel_for(end - begin, config_.threads, [&](std::size_t i) {
      auto c0=clock_s(); auto lap=[&](int n){auto c=clock_s(); tt[n]=tt[n]+c-c0; c0=c;};
      const std::size_t k = begin + i;
      Look& look = looks_[k];
      cv::Mat raw;
      {
        const std::lock_guard lock(mutex_);
        raw = frames_.grey(keyframes_[k].frame);
      }
      if (raw.empty()) {
        return;
      }
      undistorter_.undistort(raw, look.image);
      lap(0);look.T_world_cam = poses_[k] * T_imu_cam_;
      mapping::RenderedView view =
          mapping::render(grid_, camera_, look.T_world_cam, config_.render);
      lap(1);look.points = find_surface_points(look.image, mask_, view, look.T_world_cam, config_.lift,
                                        config_.tracks);
      lap(2);if (is_view(k)) {
        mapping::average_intensity(grid_, look.T_world_cam, config_.render, view);
        look.correlation = correlate(camera_gradients(look.image, mask_, config_.gradients),
                                     intensity_gradients(view, config_.gradients), view,
                                     look.T_world_cam, shrink, config_.correlation);
      lap(3);}
    });for(int n=0;n<4;++n)times_[std::string("cpu")+std::to_string(n)]+=tt[n];
  }

  /// The road below keyframes [begin, end).
  void find_ground(std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      if (const auto ground = ground_below(grid_, poses_[k].p)) {
        graph_.ground.push_back({k, *ground, 0.5 * sharing() * config_.ground_std_m});
      }
    }
  }

  /// Neighbouring keyframes share what errors they have: together they count as one.
  [[nodiscard]] double sharing() const {
    return std::sqrt(std::max(1.0, config_.error_correlation_m / config_.keyframe_m));
  }

  /// Tracks into keyframes [begin, end) from earlier ones.
  void follow(std::size_t begin, std::size_t end) {
    constexpr std::array<std::size_t, 3> kBack{1, 3, 6};
    std::vector<TrackFactor> factors;
    for (std::size_t to = begin; to < end; ++to) {
      for (const std::size_t back : kBack) {
        if (to >= back && !looks_[to].image.empty() && !looks_[to - back].image.empty()) {
          factors.push_back({to - back, to, {}});
        }
      }
    }
    parallel_for(factors.size(), config_.threads, [&](std::size_t i) {
      TrackFactor& factor = factors[i];
      const Look& from = looks_[factor.from];
      const RigidTransform T_to_from = (poses_[factor.to] * T_imu_cam_).inverse() *
                                       (poses_[factor.from] * T_imu_cam_);
      factor.tracks = track(from.image, from.points, looks_[factor.to].image, mask_, T_to_from,
                            camera_, config_.tracks);
    });
    std::move(factors.begin(), factors.end(), std::back_inserter(graph_.tracks));
  }

  /// Registers the window of views that ends before `end`.
  void register_until(std::size_t end, double share) {
    std::vector<WindowView> views;
    std::vector<std::size_t> members;
    for (std::size_t k = end; k-- > 0 && views.size() < config_.window.views;) {
      if (is_view(k)) {
        views.push_back({&looks_[k].correlation, poses_[k]});
        members.push_back(k);
      }
    }
    if (views.size() < std::min<std::size_t>(4, config_.window.views)) {
      return;
    }
    const std::size_t middle = members[members.size() / 2];
    SearchConfig search = config_.search;
    search.std *= share;
    search.seed = 1000 + middle;
    Registration found =
        register_window(views, poses_[middle], T_imu_cam_, camera_, search);
    found.keyframe = middle;
    if (std::getenv("TOPOLOC_DEBUG") != nullptr) {
      const Vector6 xi = motion_between(poses_[middle], found.T_world_imu);
      std::fprintf(stderr, "REG %lld score %.4f dist %.2f xi %.4f %.4f %.4f %.3f %.3f %.3f std %.4f %.4f %.4f %.3f %.3f %.3f pose %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
        static_cast<long long>(keyframes_[middle].time_ns), found.score, found.significance, xi(0),xi(1),xi(2),xi(3),xi(4),xi(5),
        std::sqrt(found.covariance(0,0)),std::sqrt(found.covariance(1,1)),std::sqrt(found.covariance(2,2)),std::sqrt(found.covariance(3,3)),std::sqrt(found.covariance(4,4)),std::sqrt(found.covariance(5,5)),
        found.T_world_imu.p.x(),found.T_world_imu.p.y(),found.T_world_imu.p.z(),found.T_world_imu.quaternion().x(),found.T_world_imu.quaternion().y(),found.T_world_imu.quaternion().z(),found.T_world_imu.quaternion().w());
    }
    if (found.significance >= config_.min_significance) {
      graph_.registrations.push_back(found);
    }
  }

  /// Forgets what no later window or track needs.
  void forget_before(std::size_t keyframe) {
    for (; forgotten_ < keyframe; ++forgotten_) {
      looks_[forgotten_] = {};
    }
  }

  void stat(const char*what){ static auto t0=std::chrono::steady_clock::now(); auto t=std::chrono::steady_clock::now(); times_[what]+=std::chrono::duration<double>(t-t0).count(); t0=t; }
  std::map<std::string,double> times_;
  template <typename Report>
  void first_pass(const Report& report) {
    looks_.assign(keyframes_.size(), {});
    forgotten_ = 0;
    graph_.ground.clear();
    const std::size_t batch = config_.window.stride * config_.window.view_every;
    const std::size_t window = config_.window.views * config_.window.view_every;
    for (std::size_t begin = 0; begin < keyframes_.size(); begin += batch) {
      const std::size_t end = std::min(keyframes_.size(), begin + batch);
      for (std::size_t k = std::max<std::size_t>(1, begin); k < end; ++k) {
        poses_[k] = poses_[k - 1] * step(k);
      }
stat("other");      look(begin, end, 2);stat("look");
      follow(begin, end);find_ground(begin, end);stat("follow");
      const std::size_t moving = begin > 3 * window ? begin - 3 * window : 0;
      solve_until(moving, end);
stat("solve1");      register_until(end, 1.0);stat("register");
      solve_until(moving, end);stat("solve2");
      forget_before(end > window ? end - window : 0);
      report(static_cast<double>(end) / static_cast<double>(keyframes_.size()));
    }
    solve(graph_, T_imu_cam_, camera_, 0, config_.solver, poses_);
  }

  void solve_until(std::size_t first, std::size_t end) {
    std::vector<RigidTransform> known(poses_.begin(),
                                      poses_.begin() + static_cast<std::ptrdiff_t>(end));
    solve(graph_, T_imu_cam_, camera_, first, config_.solver, known);
    std::copy(known.begin(), known.end(), poses_.begin());
  }

  template <typename Report>
  void fine_pass(const Report& report) {
    looks_.assign(keyframes_.size(), {});
    forgotten_ = 0;
    graph_.tracks.clear();
    graph_.ground.clear();
    graph_.registrations.clear();
    const std::size_t batch = config_.window.stride * config_.window.view_every;
    const std::size_t window = config_.window.views * config_.window.view_every;
    for (std::size_t begin = 0; begin < keyframes_.size(); begin += batch) {
      const std::size_t end = std::min(keyframes_.size(), begin + batch);
stat("other");      look(begin, end, 1);stat("look");
      follow(begin, end);find_ground(begin, end);stat("follow");
      register_until(end, config_.window.fine_share);stat("register");
      forget_before(end > window ? end - window : 0);
      report(static_cast<double>(end) / static_cast<double>(keyframes_.size()));
    }
    solve(graph_, T_imu_cam_, camera_, 0, config_.solver, poses_);
  }

  [[nodiscard]] std::vector<mapping::RefinedPose> judge() const {
    const std::vector<Matrix6> P =
        covariances(graph_, T_imu_cam_, camera_, config_.solver, poses_);
    std::vector<mapping::RefinedPose> result;
    for (std::size_t k = 0; k < keyframes_.size(); ++k) {
      result.push_back({keyframes_[k].frame, keyframes_[k].time_ns, poses_[k], P[k], {}, {}});
    }
    return result;
  }

  const drive::Drive& drive_;
  const PoseKnowledge& knowledge_;
  const RefinementConfig& config_;
  const mapping::CloudGrid& grid_;
  drive::FrameLog& frames_;
  std::mutex mutex_;  // guards frames_
  PinholeCamera camera_;
  RigidTransform T_imu_cam_;
  matching::Undistorter undistorter_;
  cv::Mat mask_;
  std::vector<Keyframe> keyframes_;
  std::vector<RigidTransform> poses_;  // T_world_imu of the keyframes
  std::vector<Look> looks_;
  std::size_t forgotten_ = 0;
  PoseGraph graph_;
};

}  // namespace

TrajectoryRefiner::TrajectoryRefiner(const drive::Drive& drive, PoseKnowledge knowledge,
                                     RefinementConfig config)
    : drive_(drive), knowledge_(std::move(knowledge)), config_(config) {}

std::vector<mapping::RefinedPose> TrajectoryRefiner::refine(const mapping::CloudGrid& grid,
                                                            drive::FrameLog& frames,
                                                            const mapping::Progress& progress) {
  return Run(drive_, knowledge_, config_, grid, frames).run(progress);
}

}  // namespace topoloc::refinement
