// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "overlay_image.hpp"

#include "topoloc/evaluation/median.hpp"

#include "drawing.hpp"
#include "lidar_edges.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

constexpr int kPanelWidth_px = 960;
constexpr int kTitle_px = 36;
constexpr int kCaption_px = 26;
constexpr int kSpace_px = 8;

const cv::Scalar kIntensityEdge(80, 255, 80);
const cv::Scalar kDepthEdge(60, 110, 255);

cv::Mat enlarged(const cv::Mat& image, cv::Size size, int interpolation) {
  cv::Mat out;
  cv::resize(image, out, size, 0, 0, interpolation);
  return out;
}

cv::Mat coloured(const cv::Mat& grey) {
  cv::Mat out;
  cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
  return out;
}

/// Darker and with less contrast, so that colours on it stand out.
cv::Mat backdrop(const cv::Mat& grey) {
  cv::Mat dark;
  grey.convertTo(dark, -1, 0.62, 12.0);
  return coloured(dark);
}

/// The range of all but the darkest and brightest points spread over 1 to 255, as the eye needs it;
/// single scan lines smoothed away.
cv::Mat stretched(const cv::Mat& filled) {
  constexpr double kShare = 0.03;
  std::vector<float> values;
  for (const float value : cv::Mat_<float>(filled)) {
    if (value > 0.0F) {
      values.push_back(value);
    }
  }
  if (values.empty()) {
    return cv::Mat::zeros(filled.size(), CV_8U);
  }
  const double low = evaluation::quantile(values, kShare);
  const double high = evaluation::quantile(values, 1.0 - kShare);
  const double scale = 254.0 / std::max(high - low, 1.0);
  cv::Mat out;
  filled.convertTo(out, CV_8U, scale, 1.0 - scale * low);
  cv::medianBlur(out, out, 3);
  out = cv::max(out, 1);
  out.setTo(0, filled == 0.0F);
  return out;
}

cv::Mat colour_over(const cv::Mat& grey, const cv::Mat& intensity, const cv::Mat& known) {
  constexpr double kOpacity = 0.5;
  cv::Mat colours;
  cv::applyColorMap(intensity, colours, cv::COLORMAP_TURBO);
  cv::Mat mixed = coloured(grey);
  cv::Mat blend;
  cv::addWeighted(colours, kOpacity, mixed, 1.0 - kOpacity, 0.0, blend);
  blend.copyTo(mixed, known);
  return mixed;
}

/// Thin lines at the panel's own resolution, over pixels of the smaller image.
void draw_edges(cv::Mat& panel, const cv::Mat& edges, const cv::Scalar& colour) {
  cv::Mat large = enlarged(edges, panel.size(), cv::INTER_LINEAR);
  panel.setTo(colour, large > 100);
}

/// A page that panels are put on in two columns.
class Page {
 public:
  Page(cv::Size panel, const std::string& title)
      : panel_(panel),
        page_(kTitle_px + 2 * (panel.height + kCaption_px + kSpace_px), 2 * panel.width + kSpace_px,
              CV_8UC3, kWhite) {
    draw_text(page_, title, {10, 25}, kInk, 0.65);
  }
  void put(int column, int row, const cv::Mat& image, const std::string& caption) {
    draw_text(page_, caption, corner(column, row) + cv::Point(10, 18), kInk, 0.5);
    image.copyTo(page_(cv::Rect(corner(column, row) + cv::Point(0, kCaption_px), panel_)));
  }
  /// A line of a legend, right-aligned in the caption of a panel; returns where it begins.
  int legend(int column, int row, int right_px, const std::string& text, const cv::Scalar& colour) {
    const cv::Point at = corner(column, row) + cv::Point(right_px - text_width(text), 18);
    draw_text(page_, text, at, kInk);
    const cv::Rect swatch(at.x - 26, at.y - 9, 18, 7);
    cv::rectangle(page_, swatch, colour, cv::FILLED);
    cv::rectangle(page_, swatch, kInk, 1);
    return right_px - text_width(text) - 44;
  }
  [[nodiscard]] const cv::Mat& image() const { return page_; }

 private:
  /// Of a panel with its caption.
  [[nodiscard]] cv::Point corner(int column, int row) const {
    return {column * (panel_.width + kSpace_px),
            kTitle_px + row * (panel_.height + kCaption_px + kSpace_px)};
  }

  cv::Size panel_;
  cv::Mat page_;
};

}  // namespace

cv::Mat draw_overlay(const NodeImages& images, const std::string& title) {
  const cv::Mat filled = fill_intensity(images.intensity);
  const cv::Mat depth_m = fill_depth(images.depth_m);
  const cv::Mat known = filled > 0.0F;
  const cv::Mat bright = stretched(filled);

  const double scale = static_cast<double>(kPanelWidth_px) / images.grey.cols;
  const cv::Size panel(kPanelWidth_px, static_cast<int>(std::lround(scale * images.grey.rows)));
  const cv::Mat camera = enlarged(images.grey, panel, cv::INTER_CUBIC);

  Page page(panel, title);
  page.put(0, 0, coloured(camera), "camera");
  page.put(1, 0, coloured(enlarged(bright, panel, cv::INTER_NEAREST)),
           "LiDAR intensity, small holes filled (black: nothing)");
  page.put(0, 1,
           colour_over(camera, enlarged(bright, panel, cv::INTER_LINEAR),
                       enlarged(known, panel, cv::INTER_NEAREST)),
           "LiDAR intensity over camera (blue: dark, red: bright)");
  cv::Mat edges = backdrop(camera);
  draw_edges(edges, depth_edges(depth_m), kDepthEdge);
  draw_edges(edges, intensity_edges(bright), kIntensityEdge);
  page.put(1, 1, edges, "LiDAR edges over camera");
  const int left = page.legend(1, 1, panel.width - 10, "jump of depth", kDepthEdge);
  page.legend(1, 1, left, "edge of intensity", kIntensityEdge);
  return page.image();
}

}  // namespace topoloc::apps
