// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "plan_plot.hpp"

#include "drawing.hpp"
#include "plan_view.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

const cv::Size kLargestPlan{1500, 1150};
constexpr int kLeft_px = 80;
constexpr int kTop_px = 50;
constexpr int kBottom_px = 60;
constexpr int kLegend_px = 330;
constexpr int kLeastHeight_px = 420;  ///< the legend needs it
const cv::Scalar kGapColour(60, 60, 255);

/// Smallest and largest position deviation [m] of the accepted nodes.
struct StdRange {
  double low_m = 0.0;
  double high_m = 0.0;

  explicit StdRange(const MapQuality& quality) {
    const map::Spread spread = map::Spread::of(quality.values(kPositionStd));
    low_m = spread.min;
    high_m = spread.max;
  }
  [[nodiscard]] bool all_equal() const { return high_m - low_m < 1e-3 * high_m + 1e-9; }
  [[nodiscard]] cv::Scalar colour(double std_m) const {
    return heat_colour(all_equal() ? 0.3 : (std_m - low_m) / (high_m - low_m));
  }
};

class PlanPlot {
 public:
  PlanPlot(const map::MapFile& map, const MapQuality& quality)
      : map_(map), quality_(quality), std_range_(quality), reasons_(reason_colours(quality)) {
    Eigen::AlignedBox2d box_m;
    for (const QualityNode& node : quality.nodes) {
      box_m.extend(Eigen::Vector2d(node.report.position_m.head<2>()));
    }
    view_ = PlanView::of(box_m, kLargestPlan);
    const cv::Size plan = view_.size_px();
    page_ = cv::Mat(kTop_px + std::max(plan.height, kLeastHeight_px) + kBottom_px,
                    kLeft_px + plan.width + kLegend_px, CV_8UC3, kWhite);
    plan_ = page_(cv::Rect(cv::Point(kLeft_px, kTop_px), plan));
  }

  cv::Mat draw() {
    draw_cloud(map_, view_).copyTo(plan_);
    draw_gaps();
    draw_nodes();
    label_gaps();
    draw_axes();
    draw_scale_bar();
    draw_legend();
    draw_text(page_, map_.path().filename().string() + ", from above", {kLeft_px, 30}, kInk, 0.7);
    return page_;
  }

 private:
  [[nodiscard]] cv::Point at(const QualityNode& node) const {
    return view_.pixel(node.report.position_m.head<2>());
  }

  void draw_gaps() {
    for (const mapping::NodeGap& gap : quality_.gaps) {
      for (std::size_t i = gap.after; i < gap.before; ++i) {
        cv::line(plan_, at(quality_.nodes[i]), at(quality_.nodes[i + 1]), kGapColour, 3,
                 cv::LINE_AA);
      }
    }
  }

  /// Beside the middle of the gap, on nodes and cloud.
  void label_gaps() {
    for (const mapping::NodeGap& gap : quality_.gaps) {
      const cv::Point begin = at(quality_.nodes[gap.after]);
      const cv::Point end = at(quality_.nodes[gap.before]);
      const double length_px = std::max(1.0, cv::norm(end - begin));
      constexpr double kAside_px = 45.0;
      const cv::Point aside(static_cast<int>(kAside_px * (begin.y - end.y) / length_px),
                            static_cast<int>(kAside_px * (end.x - begin.x) / length_px));
      const std::string text = fmt::format("{:.0f} m", gap.length_m);
      const int half_px = text_width(text, 0.55) / 2;
      const cv::Point middle = (begin + end) / 2 + aside;
      cv::rectangle(plan_, middle + cv::Point(-half_px - 6, -13),
                    middle + cv::Point(half_px + 6, 11), kGapColour, cv::FILLED);
      draw_text(plan_, text, middle + cv::Point(0, 6), kWhite, 0.55, Align::kCentre);
    }
  }

  void draw_nodes() {
    for (const QualityNode& node : quality_.nodes) {
      if (!node.accepted()) {
        draw_cross(plan_, at(node), reasons_.at(*node.report.rejected));
      }
    }
    for (const QualityNode& node : quality_.nodes) {
      if (node.accepted()) {
        cv::circle(plan_, at(node), 5, kWhite, cv::FILLED, cv::LINE_AA);
        cv::circle(plan_, at(node), 4, std_range_.colour(*node.figure(kPositionStd)), cv::FILLED,
                   cv::LINE_AA);
      }
    }
  }

  void draw_axes() {
    const Eigen::Vector2d low = view_.box_m.min();
    const Eigen::Vector2d high = view_.box_m.max();
    constexpr int kTickDistance_px = 130;
    const std::vector<double> xs =
        nice_ticks(low.x(), high.x(), std::max(2, plan_.cols / kTickDistance_px));
    // The same step both ways: squares.
    const double step = xs.size() > 1 ? xs[1] - xs[0] : 1.0;
    for (const double x : xs) {
      const int u = kLeft_px + static_cast<int>(view_.pixel({x, low.y()}).x);
      const int v = kTop_px + plan_.rows;
      cv::line(page_, {u, v}, {u, v + 6}, kInk, 1);
      draw_text(page_, tick_label(x, step), {u, v + 22}, kInk, 0.45, Align::kCentre);
    }
    for (const double y : ticks_every(step, low.y(), high.y())) {
      const int v = kTop_px + static_cast<int>(view_.pixel({low.x(), y}).y);
      cv::line(page_, {kLeft_px - 6, v}, {kLeft_px, v}, kInk, 1);
      draw_text(page_, tick_label(y, step), {kLeft_px - 10, v + 5}, kInk, 0.45, Align::kRight);
    }
    cv::rectangle(page_, cv::Rect(cv::Point(kLeft_px, kTop_px), plan_.size()), kInk, 1);
    draw_text(page_, "x [m]", {kLeft_px + plan_.cols / 2, kTop_px + plan_.rows + 46}, kInk, 0.5,
              Align::kCentre);
    draw_text(page_, "y [m]", {kLeft_px - 10, kTop_px + 14}, kInk, 0.5, Align::kRight);
  }

  void draw_scale_bar() {
    const double length_m = nice_step(100.0 / view_.px_per_m);
    const int length_px = static_cast<int>(std::lround(length_m * view_.px_per_m));
    const cv::Point left(20, plan_.rows - 20);
    const cv::Point right = left + cv::Point(length_px, 0);
    cv::line(plan_, left, right, kWhite, 2);
    for (const cv::Point& end : {left, right}) {
      cv::line(plan_, end - cv::Point(0, 5), end + cv::Point(0, 5), kWhite, 2);
    }
    draw_text(plan_, short_number(length_m) + " m", (left + right) / 2 - cv::Point(0, 10), kWhite,
              0.5, Align::kCentre);
  }

  void draw_legend() {
    const int x = kLeft_px + plan_.cols + 25;
    int y = kTop_px + 10;
    const auto line = [&](const std::string& text, const cv::Scalar& ink = kInk) {
      draw_text(page_, text, {x + 26, y}, ink, 0.48);
      y += 26;
    };
    draw_text(page_, fmt::format("{} accepted nodes, position std:", quality_.accepted()), {x, y},
              kInk, 0.48);
    y += 14;
    if (std_range_.all_equal()) {
      y += 12;
      cv::circle(page_, {x + 10, y - 5}, 5, std_range_.colour(std_range_.low_m), cv::FILLED,
                 cv::LINE_AA);
      line(fmt::format("{:.1f} cm, all of them", 100.0 * std_range_.low_m));
    } else {
      constexpr int kBar_px = 240;
      for (int i = 0; i < kBar_px; ++i) {
        cv::line(page_, {x + i, y}, {x + i, y + 14}, heat_colour(static_cast<double>(i) / kBar_px),
                 1);
      }
      cv::rectangle(page_, cv::Rect(x, y, kBar_px, 15), kInk, 1);
      y += 32;
      draw_text(page_, fmt::format("{:.1f} cm", 100.0 * std_range_.low_m), {x, y}, kInk, 0.45);
      draw_text(page_, fmt::format("{:.1f} cm", 100.0 * std_range_.high_m), {x + kBar_px, y}, kInk,
                0.45, Align::kRight);
      y += 34;
    }
    if (!quality_.has_report) {
      line("rejected nodes: not known", kFaint);
      line("(map without build report)", kFaint);
    } else {
      const std::size_t rejected = quality_.nodes.size() - quality_.accepted();
      draw_text(page_, fmt::format("{} rejected nodes{}", rejected, rejected > 0 ? ":" : ""),
                {x, y}, kInk, 0.48);
      y += 26;
      for (const auto& [reason, count] : quality_.rejected) {
        draw_cross(page_, {x + 10, y - 5}, reasons_.at(reason), 5);
        line(fmt::format("{}: {}", figure_title(reason), count));
      }
    }
    y += 8;
    if (!quality_.gaps.empty()) {
      cv::line(page_, {x, y - 5}, {x + 20, y - 5}, kGapColour, 3, cv::LINE_AA);
    }
    line(fmt::format("gaps of more than {:.0f} m: {}", mapping::kReportedGap_m,
                     quality_.gaps.size()));
    y += 8;
    if (map_.has_images()) {
      line(map_.has_intensity_images() ? "grey: LiDAR intensity as the"
                                       : "grey: LiDAR points as the",
           kFaint);
      line("nodes see it, up to 35 m", kFaint);
    } else {
      line("no cloud: the map is stripped", kFaint);
    }
  }

  const map::MapFile& map_;
  const MapQuality& quality_;
  StdRange std_range_;
  std::map<std::string, cv::Scalar> reasons_;
  PlanView view_;
  cv::Mat page_;
  cv::Mat plan_;  ///< part of the page
};

}  // namespace

cv::Mat draw_plan(const map::MapFile& map, const MapQuality& quality) {
  return PlanPlot(map, quality).draw();
}

}  // namespace topoloc::apps
