// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/journey.hpp"

#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::simulation {
namespace {

constexpr double kStep_s = 0.01;
constexpr double kPlace_m = 0.25;
constexpr double kPower_Wpkg = 20.0;

/// What may be driven at each place of a leg, in the direction of the leg.
std::vector<double> allowed_mps(const Leg& leg, const std::vector<double>& along_m,
                                const Path& path, const Road& road, const DrivingStyle& style,
                                const SmoothNoise& mood) {
  std::vector<double> allowed(along_m.size());
  const bool backwards = leg.to_m < leg.from_m;
  for (std::size_t i = 0; i < along_m.size(); ++i) {
    const double curvature = std::abs(path.curvature_1pm(along_m[i]));
    const double in_curve = std::sqrt(style.lateral_acceleration_mps2 / std::max(curvature, 1e-6));
    // Nobody holds a speed exactly.
    const double share = 0.95 + 0.05 * std::tanh(mood.value(along_m[i]));
    const double limit = backwards ? style.reversing_mps : road.speed_limit_mps(along_m[i]);
    allowed[i] = std::min(limit * share, in_curve);
  }
  return allowed;
}

void limit_acceleration(std::vector<double>& speed, const std::vector<double>& way_m,
                        const DrivingStyle& style) {
  speed.front() = 0.0;
  speed.back() = 0.0;
  for (std::size_t i = 1; i < speed.size(); ++i) {
    const double before = speed[i - 1];
    const double gain = std::min(style.acceleration_mps2, kPower_Wpkg / std::max(before, 0.1));
    speed[i] = std::min(speed[i], std::sqrt(before * before + 2.0 * gain * way_m[i]));
  }
  for (std::size_t i = speed.size() - 1; i > 0; --i) {
    const double after = speed[i];
    speed[i - 1] =
        std::min(speed[i - 1], std::sqrt(after * after + 2.0 * style.braking_mps2 * way_m[i]));
  }
}

/// Appends where the vehicle is, step by step.
class Clock {
 public:
  Clock(std::vector<double>& along_m, double from_m) : out_(&along_m), here_m_(from_m) {}

  /// To a place, at constant acceleration.
  void go(double to_m, double way_m, double from_mps, double to_mps) {
    const double duration_s = 2.0 * way_m / std::max(from_mps + to_mps, 1e-3);
    while (next_s() <= now_s_ + duration_s) {
      const double t = next_s() - now_s_;
      const double gone_m =
          from_mps * t + 0.5 * (to_mps - from_mps) / std::max(duration_s, 1e-9) * t * t;
      out_->push_back(here_m_ + (to_m - here_m_) * std::clamp(gone_m / way_m, 0.0, 1.0));
    }
    now_s_ += duration_s;
    here_m_ = to_m;
  }
  void stand(double duration_s) {
    while (next_s() <= now_s_ + duration_s) {
      out_->push_back(here_m_);
    }
    now_s_ += duration_s;
  }

 private:
  /// Time of the next step.
  [[nodiscard]] double next_s() const { return static_cast<double>(out_->size()) * kStep_s; }

  std::vector<double>* out_;
  double here_m_;
  double now_s_ = 0.0;
};

void drive(const Leg& leg, const Path& path, const Road& road, const DrivingStyle& style,
           const SmoothNoise& mood, Clock& clock) {
  const auto places = static_cast<std::size_t>(
      std::max(2.0, std::ceil(std::abs(leg.to_m - leg.from_m) / kPlace_m)));
  std::vector<double> along_m(places + 1);
  std::vector<double> way_m(places + 1, 0.0);
  for (std::size_t i = 0; i <= places; ++i) {
    along_m[i] =
        std::lerp(leg.from_m, leg.to_m, static_cast<double>(i) / static_cast<double>(places));
    if (i > 0) {
      const double middle_m = 0.5 * (along_m[i - 1] + along_m[i]);
      way_m[i] = std::abs(along_m[i] - along_m[i - 1]) * path.stretch(middle_m);
    }
  }
  std::vector<double> speed = allowed_mps(leg, along_m, path, road, style, mood);
  limit_acceleration(speed, way_m, style);
  for (std::size_t i = 1; i <= places; ++i) {
    clock.go(along_m[i], way_m[i], speed[i - 1], speed[i]);
  }
}

/// Mean over `width` samples around each.
std::vector<double> running_mean(const std::vector<double>& values, std::size_t half) {
  std::vector<double> means(values.size());
  const auto at = [&](std::ptrdiff_t i) {
    return values[static_cast<std::size_t>(
        std::clamp(i, std::ptrdiff_t{0}, static_cast<std::ptrdiff_t>(values.size()) - 1))];
  };
  const auto reach = static_cast<std::ptrdiff_t>(half);
  for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(values.size()); ++i) {
    double sum = 0.0;
    for (std::ptrdiff_t j = i - reach; j <= i + reach; ++j) {
      sum += at(j);
    }
    means[static_cast<std::size_t>(i)] = sum / static_cast<double>(2 * reach + 1);
  }
  return means;
}

}  // namespace

Journey::Journey(const Path& path, const Road& road, const std::vector<Leg>& legs,
                 const DrivingStyle& style, std::uint64_t key) {
  const SmoothNoise mood(world::key(key, {1}), 40.0);
  Clock clock(along_m_, legs.front().from_m);
  // Smoothing takes its time from the stands.
  const double more_s = style.smoothing_s + 0.1;
  clock.stand(style.first_stand_s + more_s);
  for (const Leg& leg : legs) {
    drive(leg, path, road, style, mood, clock);
    clock.stand(leg.stand_s + more_s);
  }
  const auto half = static_cast<std::size_t>(std::lround(0.5 * style.smoothing_s / kStep_s));
  along_m_ = running_mean(running_mean(along_m_, half), half);
  duration_s_ = static_cast<double>(along_m_.size() - 1) * kStep_s;
}

double Journey::along_m(double time_s) const {
  const double place = std::clamp(time_s, 0.0, duration_s_) / kStep_s;
  const std::size_t first = std::min(static_cast<std::size_t>(place), along_m_.size() - 2);
  return std::lerp(along_m_[first], along_m_[first + 1], place - static_cast<double>(first));
}

}  // namespace topoloc::simulation
