// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "figure_plot.hpp"

#include "drawing.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

constexpr int kChartWidth_px = 1300;
constexpr int kChartHeight_px = 110;
constexpr int kCaption_px = 34;  ///< above each chart
constexpr int kLeft_px = 90;
constexpr int kRight_px = 40;
constexpr int kBottom_px = 60;
constexpr int kLegendLine_px = 24;
const cv::Scalar kLine(190, 120, 40);

/// Range of an axis with room above and below; from 0 where the values reach down to a third.
struct AxisRange {
  double low = 0.0;
  double high = 1.0;

  explicit AxisRange(const std::vector<double>& values) {
    if (values.empty()) {
      return;
    }
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    low = *least;
    high = *most;
    // Rounding is not worth a chart.
    const bool all_equal = high - low <= 1e-3 * std::abs(high);
    const double room = all_equal ? 0.1 * std::abs(high) + 1e-9 : 0.08 * (high - low);
    high += room;
    low = low >= 0.0 && low < 0.34 * high ? 0.0 : low - room;
  }
};

class FigurePlot {
 public:
  explicit FigurePlot(const MapQuality& quality)
      : quality_(quality), names_(quality.figure_names()), reasons_(reason_colours(quality)) {
    length_m_ = std::max(1.0, quality.nodes.back().along_m);
    const int charts = static_cast<int>(names_.size());
    page_ = cv::Mat(top_px() + charts * (kChartHeight_px + kCaption_px) + kBottom_px,
                    kLeft_px + kChartWidth_px + kRight_px, CV_8UC3, kWhite);
  }

  cv::Mat draw(const std::string& title) {
    draw_text(page_, title, {kLeft_px, 30}, kInk, 0.7);
    draw_legend();
    int top = top_px();
    for (const std::string& name : names_) {
      draw_chart(name, top + kCaption_px);
      top += kChartHeight_px + kCaption_px;
    }
    draw_way(top);
    return page_;
  }

 private:
  [[nodiscard]] int top_px() const {
    return 48 + kLegendLine_px * static_cast<int>(reasons_.size() + 1);
  }
  [[nodiscard]] int column(double along_m) const {
    return kLeft_px + static_cast<int>(std::lround(along_m / length_m_ * kChartWidth_px));
  }

  void draw_legend() {
    int y = 58;
    cv::circle(page_, {kLeft_px + 8, y - 5}, 3, kLine, cv::FILLED, cv::LINE_AA);
    draw_text(page_,
              fmt::format("{} accepted nodes (grey line: their median)", quality_.accepted()),
              {kLeft_px + 26, y}, kInk, 0.48);
    for (const auto& [reason, colour] : reasons_) {
      y += kLegendLine_px;
      draw_cross(page_, {kLeft_px + 8, y - 5}, colour, 4);
      draw_text(page_,
                fmt::format("{} rejected: {} (bar: no such figure)", quality_.rejected.at(reason),
                            figure_title(reason)),
                {kLeft_px + 26, y}, kInk, 0.48);
    }
  }

  void draw_chart(const std::string& name, int top) {
    std::vector<double> values = quality_.values(name);
    const map::Spread accepted = map::Spread::of(values);
    for (const auto& [reason, count] : quality_.rejected) {
      const std::vector<double> more = quality_.values(name, reason);
      values.insert(values.end(), more.begin(), more.end());
    }
    const AxisRange range(values);
    const auto row = [&](double value) {
      return top + kChartHeight_px -
             static_cast<int>(
                 std::lround((value - range.low) / (range.high - range.low) * kChartHeight_px));
    };
    const std::vector<double> ticks = nice_ticks(range.low, range.high, 4);
    for (const double tick : ticks) {
      cv::line(page_, {kLeft_px, row(tick)}, {kLeft_px + kChartWidth_px, row(tick)}, kGrid, 1);
      draw_text(page_, tick_label(tick, ticks.size() > 1 ? ticks[1] - ticks[0] : tick),
                {kLeft_px - 8, row(tick) + 5}, kInk, 0.42, Align::kRight);
    }
    for (const double x_m : way_ticks()) {
      cv::line(page_, {column(x_m), top}, {column(x_m), top + kChartHeight_px}, kGrid, 1);
    }
    cv::line(page_, {kLeft_px, row(accepted.median)},
             {kLeft_px + kChartWidth_px, row(accepted.median)}, kFaint, 1);
    draw_accepted(name, row);
    draw_rejected(name, row, top);
    cv::rectangle(page_, {kLeft_px, top, kChartWidth_px, kChartHeight_px}, kFaint, 1);
    draw_text(page_, figure_title(name), {kLeft_px, top - 8}, kInk, 0.5);
    draw_text(page_,
              fmt::format("median {}, {} to {}", short_number(accepted.median),
                          short_number(accepted.min), short_number(accepted.max)),
              {kLeft_px + kChartWidth_px, top - 8}, kFaint, 0.45, Align::kRight);
  }

  template <typename Row>
  void draw_accepted(const std::string& name, const Row& row) {
    const QualityNode* last = nullptr;
    for (const QualityNode& node : quality_.nodes) {
      const auto value = node.accepted() ? node.figure(name) : std::nullopt;
      // The line ends where a node is missing.
      if (!value) {
        last = nullptr;
        continue;
      }
      const cv::Point at(column(node.along_m), row(*value));
      if (last != nullptr) {
        cv::line(page_, {column(last->along_m), row(*last->figure(name))}, at, kLine, 1,
                 cv::LINE_AA);
      }
      cv::circle(page_, at, 2, kLine, cv::FILLED, cv::LINE_AA);
      last = &node;
    }
  }

  template <typename Row>
  void draw_rejected(const std::string& name, const Row& row, int top) {
    for (const QualityNode& node : quality_.nodes) {
      if (node.accepted()) {
        continue;
      }
      const cv::Scalar& colour = reasons_.at(*node.report.rejected);
      const auto value = node.figure(name);
      if (value) {
        draw_cross(page_, {column(node.along_m), row(*value)}, colour, 4);
      } else {
        const int bottom = top + kChartHeight_px;
        cv::line(page_, {column(node.along_m), bottom - 8}, {column(node.along_m), bottom + 3},
                 colour, 2, cv::LINE_AA);
      }
    }
  }

  [[nodiscard]] std::vector<double> way_ticks() const { return nice_ticks(0.0, length_m_, 12); }

  void draw_way(int top) {
    const std::vector<double> ticks = way_ticks();
    for (const double x_m : ticks) {
      draw_text(page_, tick_label(x_m, ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0),
                {column(x_m), top + 18}, kInk, 0.45, Align::kCentre);
    }
    draw_text(page_, "way along the planned nodes [m]", {kLeft_px + kChartWidth_px / 2, top + 42},
              kInk, 0.5, Align::kCentre);
  }

  const MapQuality& quality_;
  std::vector<std::string> names_;
  std::map<std::string, cv::Scalar> reasons_;
  double length_m_ = 1.0;
  cv::Mat page_;
};

}  // namespace

cv::Mat draw_figures(const map::MapFile& map, const MapQuality& quality) {
  return FigurePlot(quality).draw(map.path().filename().string() + ", figures of its nodes");
}

}  // namespace topoloc::apps
