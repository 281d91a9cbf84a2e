// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "drawing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/core.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

/// Apart from one another and from the blue to red of heat_colour(); the last one is for all
/// others.
const std::array kReasonColours{cv::Scalar(220, 0, 220), cv::Scalar(0, 0, 0),
                                cv::Scalar(110, 70, 20), cv::Scalar(255, 130, 170),
                                cv::Scalar(20, 80, 130), cv::Scalar(120, 120, 120)};

}  // namespace

int text_width(const std::string& text, double size) {
  int base = 0;
  return cv::getTextSize(text, kFont, size, 1, &base).width;
}

void draw_text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour,
               double size, Align align) {
  if (align != Align::kLeft) {
    at.x -= align == Align::kRight ? text_width(text, size) : text_width(text, size) / 2;
  }
  cv::putText(canvas, text, at, kFont, size, colour, 1, cv::LINE_AA);
}

void draw_cross(cv::Mat& canvas, cv::Point at, const cv::Scalar& colour, int half_px) {
  for (const auto& [ink, width] : {std::pair(kWhite, 5), std::pair(colour, 2)}) {
    const cv::Point diagonal(half_px, half_px);
    const cv::Point other(half_px, -half_px);
    cv::line(canvas, at - diagonal, at + diagonal, ink, width, cv::LINE_AA);
    cv::line(canvas, at - other, at + other, ink, width, cv::LINE_AA);
  }
}

cv::Scalar heat_colour(double share) {
  static const cv::Mat table = [] {
    cv::Mat ramp(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i) {
      ramp.at<unsigned char>(0, i) = static_cast<unsigned char>(i);
    }
    cv::Mat colours;
    cv::applyColorMap(ramp, colours, cv::COLORMAP_TURBO);
    return colours;
  }();
  // The ends of the table are too dark to be seen.
  const double at = 25.0 + 215.0 * std::clamp(share, 0.0, 1.0);
  return table.at<cv::Vec3b>(0, static_cast<int>(std::lround(at)));
}

std::map<std::string, cv::Scalar> reason_colours(const MapQuality& quality) {
  std::map<std::string, cv::Scalar> colours;
  for (const auto& [reason, count] : quality.rejected) {
    colours[reason] = kReasonColours[std::min(colours.size(), kReasonColours.size() - 1)];
  }
  return colours;
}

double nice_step(double at_least) {
  const double power = std::pow(10.0, std::floor(std::log10(at_least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= 0.999 * at_least) {
      return factor * power;
    }
  }
  return 10.0 * power;
}

std::vector<double> ticks_every(double step, double low, double high) {
  constexpr double kRounding = 1e-9;
  std::vector<double> ticks;
  const auto first = static_cast<long>(std::ceil(low / step - kRounding));
  const auto last = static_cast<long>(std::floor(high / step + kRounding));
  for (long i = first; i <= last; ++i) {
    ticks.push_back(static_cast<double>(i) * step);
  }
  return ticks;
}

std::vector<double> nice_ticks(double low, double high, int count) {
  const double raw = (high - low) / count;
  if (!(raw > 0.0) || !std::isfinite(raw)) {
    return {low};
  }
  return ticks_every(nice_step(raw), low, high);
}

std::string tick_label(double value, double step) {
  const double decimals = step > 0.0 ? std::ceil(-std::log10(step) - 1e-9) : 0.0;
  return fmt::format("{:.{}f}", value == 0.0 ? 0.0 : value,
                     static_cast<int>(std::clamp(decimals, 0.0, 6.0)));
}

std::string short_number(double value) { return fmt::format("{:.4g}", value); }

std::string figure_title(const std::string& name) {
  constexpr std::array kUnits{"m", "cm", "mm", "px", "rad", "mrad", "deg", "s", "mps", "percent"};
  std::string title = name;
  std::string unit;
  const std::size_t last = name.rfind('_');
  if (last != std::string::npos &&
      std::find(kUnits.begin(), kUnits.end(), name.substr(last + 1)) != kUnits.end()) {
    unit = " [" + name.substr(last + 1) + "]";
    title.resize(last);
  }
  std::replace(title.begin(), title.end(), '_', ' ');
  return title + unit;
}

void write_png(const std::filesystem::path& file, const cv::Mat& image) {
  bool written = false;
  try {
    written = cv::imwrite(file.string(), image);
  } catch (const cv::Exception& error) {
    throw std::runtime_error(file.string() + ": cannot write: " + error.what());
  }
  if (!written) {
    throw std::runtime_error(file.string() + ": cannot write");
  }
}

}  // namespace topoloc::apps
