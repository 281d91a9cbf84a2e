// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "topoloc/evaluation/median.hpp"
#include "topoloc/matching/undistorter.hpp"
#include "topoloc/refinement/ground.hpp"

#include "refinement/choice.hpp"
#include "refinement/cloud_check.hpp"
#include "refinement/keyframes.hpp"
#include "refinement/match_route.hpp"
#include "refinement/parallel_for.hpp"
#include "refinement/verdict.hpp"
#include "refinement/window_route.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

namespace topoloc::refinement {
namespace {

/// What is known of a keyframe's image, as long as a window or a track needs it.
struct Look {
  cv::Mat raw;    // of views that are to be matched
  cv::Mat image;  // undistorted
  std::vector<SurfacePoint> points;
  ViewCorrelation correlation;
  double correlation_seconds = 0.0;
};

/// The matching camera at another resolution.
PinholeCamera scaled(const PinholeCamera& camera, double scale) {
  return resized(camera, {static_cast<int>(std::lround(camera.width_px * scale)),
                          static_cast<int>(std::lround(camera.height_px * scale))});
}

/// Median way from keyframe to keyframe; `least_m` of a single one.
double usual_spacing_m(const std::vector<Keyframe>& keyframes, double least_m) {
  std::vector<double> steps_m;
  for (std::size_t k = 1; k < keyframes.size(); ++k) {
    steps_m.push_back(step_m(keyframes, k));
  }
  return steps_m.empty() ? least_m : evaluation::median(std::move(steps_m));
}

constexpr std::array<std::pair<Routes, const char*>, 3> kRouteNames{
    {{Routes::kCorrelation, "correlation"},
     {Routes::kMatches, "matches"},
     {Routes::kAuto, "auto"}}};

/// Seconds since it was made.
class StopWatch {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// One run over a drive.
class Run {
 public:
  Run(const drive::Drive& drive, const PoseKnowledge& knowledge, const RefinementConfig& config,
      const mapping::CloudGrid& grid, drive::FrameLog& frames, matching::ImagePairMatcher* matcher,
      std::vector<RegistrationAttempt>& attempts)
      : drive_(drive),
        config_(config),
        grid_(grid),
        frames_(frames),
        camera_(scaled(matching::matching_camera(drive.vehicle.matching), config.camera_scale)),
        T_imu_cam_(drive.vehicle.camera.kalibr.T_imu_cam),
        undistorter_(drive.vehicle.camera.kalibr.calibration, camera_),
        mask_(undistorter_.mask(drive::read_mask(drive.vehicle.camera), kMaskMargin_px)),
        keyframes_(choose_keyframes(drive, knowledge, frames, config)),
        spacing_m_(usual_spacing_m(keyframes_, config.keyframe_m)),
        window_route_(grid, camera_, T_imu_cam_, mask_, config),
        attempts_(attempts) {
    if (config.routes != Routes::kCorrelation) {
      match_route_.emplace(drive, grid, *matcher, config);
    }
  }

  std::vector<mapping::RefinedPose> run(const mapping::Progress& progress) {
    const int passes = 1 + config_.window.fine_passes;
    const auto report = [&](int pass, std::size_t done) {
      if (progress) {
        progress((pass + static_cast<double>(done) / static_cast<double>(keyframes_.size())) /
                 passes);
      }
    };
    start();
    first_pass([&](std::size_t done) { report(0, done); });
    // Without any registration the other passes would search less far from where this one did.
    for (pass_ = 1; pass_ < passes && stretches_registered_ > 0; ++pass_) {
      fine_pass([&](std::size_t done) { report(pass_, done); });
    }
    return judge({keyframes_, poses_, graph_, stretches_tried_, stretches_registered_,
                  window_route_.lens(), T_imu_cam_, camera_},
                 config_);
  }

 private:
  static constexpr int kMaskMargin_px = 2;
  /// Of windows whose lens is looked at: a wrong one makes all of them less significant.
  static constexpr double kNotChance = 4.0;

  /// What odometry and the trajectory or initial pose say, and first poses from it.
  void start() {
    graph_.rate_error_std_radps = drive_.vehicle.estimator.initial.gyro_bias_radps;
    graph_.force_error_std_mps2 = drive_.vehicle.estimator.initial.accel_bias_mps2;
    graph_.gyro_scale_std = drive_.vehicle.estimator.models.gyro_scale_std;
    graph_.turn_error_std_rad = drive_.vehicle.estimator.models.speed.rotation_std_rad;
    graph_.scale_error_std = drive_.vehicle.estimator.models.speed.std_forward_relative;
    const double shared = sharing(config_.error_correlation_m);
    Vector6 prior_std;
    prior_std << Eigen::Vector3d::Constant(config_.prior_std_rad),
        Eigen::Vector3d::Constant(config_.prior_std_m);
    for (std::size_t k = 0; k < keyframes_.size(); ++k) {
      const Keyframe& keyframe = keyframes_[k];
      poses_.push_back(keyframe.T_prior.value_or(keyframe.T_odometry));
      graph_.gravity.push_back({k, keyframe.up_imu, shared * keyframe.up_std_rad});
      if (k > 0) {
        const double seconds = evaluation::kSecondsPerNs *
                               static_cast<double>(keyframe.time_ns - keyframes_[k - 1].time_ns);
        graph_.odometry.push_back(
            {k - 1, k, step(k), seconds, motion_std(step(k), seconds, config_.odometry)});
      }
      if (keyframe.T_prior) {
        graph_.priors.push_back({k, *keyframe.T_prior, shared * prior_std});
      }
    }
    // Without a trajectory only the first poses are where odometry has them.
    const std::size_t known = graph_.priors.empty() ? window_keyframes() : poses_.size();
    check_cloud(grid_, camera_, T_imu_cam_, std::span(poses_).first(std::min(known, poses_.size())),
                config_.render.max_depth_m);
    if (graph_.priors.empty()) {
      graph_.priors.push_back({0, poses_[0], prior_std});
    } else {
      find_ground(0, keyframes_.size());
      solve_until(0, keyframes_.size());
      graph_.ground.clear();
    }
  }

  /// By what a keyframe's deviation grows so that all that share an error count as one together.
  [[nodiscard]] double sharing(double correlation_m) const {
    return std::sqrt(std::max(1.0, correlation_m / spacing_m_));
  }

  /// Motion from the keyframe before.
  [[nodiscard]] RigidTransform step(std::size_t to) const {
    return keyframes_[to - 1].T_odometry.inverse() * keyframes_[to].T_odometry;
  }

  /// Stretch by stretch, each starting from where odometry leads on from the last (M8): wide
  /// search, at half the resolution.
  template <typename Report>
  void first_pass(const Report& report) {
    constexpr int kShrink = 2;
    constexpr std::size_t kMovingWindows = 3;  // poses further back stay as they are
    by_stretches([&](std::size_t begin, std::size_t end) {
      for (std::size_t k = std::max<std::size_t>(1, begin); k < end; ++k) {
        poses_[k] = poses_[k - 1] * step(k);
      }
      observe(begin, end, kShrink);
      const std::size_t moving = kMovingWindows * window_keyframes();
      solve_until(begin > moving ? begin - moving : 0, end);
      register_stretch(begin, end, 1.0);
      solve_until(begin > moving ? begin - moving : 0, end);
      report(end);
    });
    solve_until(0, keyframes_.size());
  }

  /// Everything anew from the poses found so far, then all together.
  template <typename Report>
  void fine_pass(const Report& report) {
    graph_.tracks.clear();
    graph_.ground.clear();
    graph_.registrations.clear();
    by_stretches([&](std::size_t begin, std::size_t end) {
      observe(begin, end, 1);
      register_stretch(begin, end, config_.window.fine_share);
      report(end);
    });
    solve_until(0, keyframes_.size());
  }

  template <typename Work>
  void by_stretches(const Work& work) {
    looks_.assign(keyframes_.size(), {});
    stretches_tried_ = stretches_registered_ = 0;
    for (std::size_t begin = 0, end = 0; begin < keyframes_.size(); begin = end) {
      end = end_of_stretch(begin);
      work(begin, end);
      // What no later window or track needs is forgotten.
      const std::size_t kept = std::max(window_keyframes(), kTrackBack.back());
      for (std::size_t k = begin > kept ? begin - kept : 0; k + kept < end; ++k) {
        looks_[k] = {};
      }
    }
  }

  /// The next `stride` views and the keyframes after them.
  [[nodiscard]] std::size_t end_of_stretch(std::size_t begin) const {
    std::size_t views = 0;
    for (std::size_t k = begin; k < keyframes_.size(); ++k) {
      views += keyframes_[k].is_view ? 1 : 0;
      if (views > config_.window.stride) {
        return k;
      }
    }
    return keyframes_.size();
  }

  /// No window reaches further back.
  [[nodiscard]] std::size_t window_keyframes() const {
    const double a_view = std::ceil(config_.window.view_m / config_.keyframe_m);
    return config_.window.views * static_cast<std::size_t>(a_view);
  }

  /// Looks at keyframes [begin, end) from their poses: correlation, tracks into them, ground.
  void observe(std::size_t begin, std::size_t end, int shrink) {
    parallel_for(end - begin, config_.threads,
                 [&](std::size_t i) { looks_[begin + i] = look(begin + i, shrink); });
    follow(begin, end);
    find_ground(begin, end);
  }

  Look look(std::size_t keyframe, int shrink) {
    cv::Mat raw;
    {
      const std::lock_guard lock(frames_mutex_);
      raw = frames_.grey(keyframes_[keyframe].frame);
    }
    Look look;
    if (raw.empty()) {
      return look;  // counted by the log
    }
    undistorter_.undistort(raw, look.image);
    const bool is_view = keyframes_[keyframe].is_view;
    if (is_view && match_route_) {
      look.raw = raw;
    }
    const RigidTransform T_world_cam = poses_[keyframe] * T_imu_cam_;
    mapping::RenderedView view = mapping::render(grid_, camera_, T_world_cam, config_.render);
    look.points =
        find_surface_points(look.image, mask_, view, T_world_cam, config_.lift, config_.tracks);
    if (is_view && config_.routes != Routes::kMatches) {
      const StopWatch watch;
      look.correlation = window_route_.correlated(look.image, std::move(view), T_world_cam, shrink);
      look.correlation_seconds = watch.seconds();
    }
    return look;
  }

  /// Tracks into keyframes [begin, end) from earlier ones.
  void follow(std::size_t begin, std::size_t end) {
    std::vector<TrackFactor> factors;
    for (std::size_t to = begin; to < end; ++to) {
      for (const std::size_t back : kTrackBack) {
        if (to >= back && !looks_[to].image.empty() && !looks_[to - back].image.empty()) {
          factors.push_back({to - back, to, {}, 0});
        }
      }
    }
    parallel_for(factors.size(), config_.threads, [&](std::size_t i) {
      TrackFactor& factor = factors[i];
      const RigidTransform T_to_from =
          (poses_[factor.to] * T_imu_cam_).inverse() * (poses_[factor.from] * T_imu_cam_);
      FollowedPoints followed =
          track(looks_[factor.from].image, looks_[factor.from].points, looks_[factor.to].image,
                mask_, T_to_from, camera_, config_.tracks);
      factor.tracks = std::move(followed.tracks);
      factor.behind = followed.behind;
    });
    std::move(factors.begin(), factors.end(), std::back_inserter(graph_.tracks));
  }

  /// The road below keyframes [begin, end).
  void find_ground(std::size_t begin, std::size_t end) {
    const double std_m = sharing(config_.ground_correlation_m) * config_.ground_std_m;
    for (std::size_t k = begin; k < end; ++k) {
      if (const auto ground = ground_below(grid_, poses_[k].p)) {
        graph_.ground.push_back({k, *ground, std_m});
      }
    }
  }

  /// Registers what keyframes [begin, end) add, by the routes that are asked for.
  void register_stretch(std::size_t begin, std::size_t end, double search_share) {
    const std::size_t first_attempt = attempts_.size();
    if (config_.routes != Routes::kMatches) {
      correlate_window(begin, end, search_share);
    }
    if (match_route_ && !is_fruitless()) {
      match_views(begin, end, search_share);
    }
    double stretch_m = config_.keyframe_m;
    for (std::size_t k = begin + 1; k < end; ++k) {
      stretch_m += step(k).p.norm();
    }
    choose(std::span(attempts_).subspan(first_attempt), stretch_m);
  }

  /// Registers the window of views that ends with keyframe end - 1 (route b).
  void correlate_window(std::size_t begin, std::size_t end, double search_share) {
    const StopWatch watch;
    double seconds = 0.0;  // spent on what keyframes [begin, end) add
    std::vector<WindowView> views;
    std::vector<std::size_t> members;
    for (std::size_t k = end; k-- > 0 && views.size() < config_.window.views;) {
      if (keyframes_[k].is_view) {
        views.push_back({&looks_[k].correlation, poses_[k]});
        members.push_back(k);
        seconds += k >= begin ? looks_[k].correlation_seconds : 0.0;
      }
    }
    if (2 * views.size() < config_.window.views) {
      return;
    }
    const std::size_t middle = members[members.size() / 2];
    const Vector6 std = search_share * config_.search.std;
    const Registration found =
        window_route_.registered(views, poses_[middle], std, config_.search.seed + middle);
    record(middle, found, seconds + watch.seconds());
    const bool is_last_pass = pass_ == config_.window.fine_passes;
    if (is_last_pass && found.significance > kNotChance &&
        stretches_tried_ % config_.window.lens_sweep_every == 0) {
      window_route_.try_lenses(views, poses_[middle], found.T_world_imu);
    }
  }

  /// Registers the views among keyframes [begin, end), one by one (route a).
  void match_views(std::size_t begin, std::size_t end, double search_share) {
    std::vector<std::size_t> views;
    for (std::size_t k = begin; k < end; ++k) {
      if (keyframes_[k].is_view && !looks_[k].image.empty()) {
        views.push_back(k);
      }
    }
    struct Prepared {
      MatchRoute::Pair pair;
      double seconds = 0.0;
    };
    std::vector<Prepared> prepared(views.size());
    parallel_for(views.size(), config_.threads, [&](std::size_t i) {
      const StopWatch watch;
      prepared[i].pair = match_route_->prepare(looks_[views[i]].raw, poses_[views[i]]);
      prepared[i].seconds = watch.seconds();
    });
    for (std::size_t i = 0; i < views.size(); ++i) {
      const StopWatch watch;
      const Registration found =
          match_route_->registered(prepared[i].pair, search_share * config_.search.std);
      const bool significant = record(views[i], found, prepared[i].seconds + watch.seconds());
      fruitless_views_ = significant ? 0 : fruitless_views_ + 1;
    }
  }

  /// The probe has shown that matches do not find anything in this drive.
  [[nodiscard]] bool is_fruitless() const {
    return config_.routes == Routes::kAuto && fruitless_views_ >= config_.fruitless_views;
  }

  /// Notes a registration of a keyframe, found from its present pose; whether it is significant.
  bool record(std::size_t keyframe, Registration found, double seconds) {
    found.keyframe = keyframe;
    const bool significant =
        found.significance >= (found.route == Route::kMatches ? config_.min_match_significance
                                                              : config_.min_significance);
    attempts_.push_back({keyframes_[keyframe].time_ns, pass_, poses_[keyframe], found, significant,
                         false, seconds});
    return significant;
  }

  /// Takes of a stretch's attempts into the graph what is significant and agrees.
  void choose(std::span<RegistrationAttempt> attempts, double stretch_m) {
    if (attempts.empty()) {
      return;
    }
    ++stretches_tried_;
    std::vector<RegistrationAttempt*> candidates;
    std::vector<Registration> registrations;
    for (RegistrationAttempt& attempt : attempts) {
      if (attempt.significant) {
        candidates.push_back(&attempt);
        registrations.push_back(attempt.found);
      }
    }
    std::vector<Registration> chosen;
    for (const std::size_t i : agreeing_with_the_surest(registrations, poses_)) {
      candidates[i]->accepted = true;
      chosen.push_back(registrations[i]);
    }
    share_errors(chosen, stretch_m, config_.error_correlation_m);
    std::move(chosen.begin(), chosen.end(), std::back_inserter(graph_.registrations));
    stretches_registered_ += registrations.empty() ? 0 : 1;
  }

  /// Solves for poses [first, end), earlier ones fixed, later ones not there yet.
  void solve_until(std::size_t first, std::size_t end) {
    std::vector<RigidTransform> known(poses_.begin(),
                                      poses_.begin() + static_cast<std::ptrdiff_t>(end));
    solve(graph_, T_imu_cam_, camera_, first, config_.solver, known);
    std::copy(known.begin(), known.end(), poses_.begin());
  }

  /// Tracks lead to a keyframe from so many before it: short ones are sure, long ones precise.
  static constexpr std::array<std::size_t, 3> kTrackBack{1, 3, 6};

  const drive::Drive& drive_;
  const RefinementConfig& config_;
  const mapping::CloudGrid& grid_;
  drive::FrameLog& frames_;
  std::mutex frames_mutex_;
  PinholeCamera camera_;
  RigidTransform T_imu_cam_;
  matching::Undistorter undistorter_;
  cv::Mat mask_;
  std::vector<Keyframe> keyframes_;
  double spacing_m_;                   // usual way from keyframe to keyframe
  std::vector<RigidTransform> poses_;  // T_world_imu of the keyframes
  std::vector<Look> looks_;
  std::size_t stretches_tried_ = 0;
  std::size_t stretches_registered_ = 0;
  PoseGraph graph_;
  WindowRoute window_route_;
  std::optional<MatchRoute> match_route_;
  std::size_t fruitless_views_ = 0;  // in a row
  int pass_ = 0;
  std::vector<RegistrationAttempt>& attempts_;
};

}  // namespace

Routes parse_routes(const std::string& text) {
  for (const auto& [routes, name] : kRouteNames) {
    if (text == name) {
      return routes;
    }
  }
  throw std::invalid_argument("refinement: unknown routes \"" + text + "\"");
}

TrajectoryRefiner::TrajectoryRefiner(const drive::Drive& drive, PoseKnowledge knowledge,
                                     RefinementConfig config,
                                     std::unique_ptr<matching::ImagePairMatcher> matcher)
    : drive_(drive),
      knowledge_(std::move(knowledge)),
      config_(std::move(config)),
      matcher_(std::move(matcher)) {
  if (knowledge_.trajectory.has_value() == knowledge_.initial_pose.has_value()) {
    throw std::invalid_argument("refinement: needs a trajectory or an initial pose, not both");
  }
  if (config_.routes != Routes::kCorrelation && !matcher_) {
    throw std::invalid_argument("refinement: these routes need a matcher of image pairs");
  }
}

std::string TrajectoryRefiner::name() const {
  const auto* const named = std::find_if(kRouteNames.begin(), kRouteNames.end(),
                                         [&](const auto& n) { return n.first == config_.routes; });
  return named->second;
}

std::string TrajectoryRefiner::settings() const {
  const auto& c = config_;
  std::string text =
      fmt::format("routes: {}\nframes: {}\nkeyframes: {} m\nprior: {} m {} rad\n", name(),
                  static_cast<int>(c.frames), c.keyframe_m, c.prior_std_m, c.prior_std_rad);
  if (knowledge_.initial_pose) {
    const Eigen::Quaterniond q = knowledge_.initial_pose->quaternion();
    const Eigen::Vector3d& p = knowledge_.initial_pose->p;
    text += fmt::format("initial pose: {} {} {} {} {} {} {}\n", p.x(), p.y(), p.z(), q.x(), q.y(),
                        q.z(), q.w());
  }
  return text;
}

std::vector<mapping::RefinedPose> TrajectoryRefiner::refine(const mapping::CloudGrid& grid,
                                                            drive::FrameLog& frames,
                                                            const mapping::Progress& progress) {
  attempts_.clear();
  return Run(drive_, knowledge_, config_, grid, frames, matcher_.get(), attempts_).run(progress);
}

}  // namespace topoloc::refinement
