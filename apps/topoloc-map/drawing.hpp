// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

/// What all drawings of topoloc-map share. Colours are BGR, as OpenCV wants them.
namespace topoloc::apps {

inline const cv::Scalar kWhite{255, 255, 255};
inline const cv::Scalar kInk{40, 40, 40};
inline const cv::Scalar kFaint{150, 150, 150};
inline const cv::Scalar kGrid{225, 225, 225};

enum class Align { kLeft, kCentre, kRight };

/// Writes a line of text (ASCII) with its base line at `at`. Height of a capital: 21 px * `size`.
void draw_text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour,
               double size = 0.5, Align align = Align::kLeft);
/// Width in pixels that draw_text() needs.
int text_width(const std::string& text, double size = 0.5);

/// A cross with a bright rim, to be seen on anything.
void draw_cross(cv::Mat& canvas, cv::Point at, const cv::Scalar& colour, int half_px = 6);

/// Colour for a share 0 to 1: dark blue over green to dark red.
cv::Scalar heat_colour(double share);

/// A colour for each reason of rejection.
std::map<std::string, cv::Scalar> reason_colours(const MapQuality& quality);

/// The smallest of 1, 2 and 5 times a power of ten that is not less.
double nice_step(double at_least);
/// The multiples of `step` within [low, high].
std::vector<double> ticks_every(double step, double low, double high);
/// Round numbers (1, 2 or 5 times a power of ten apart) within [low, high], about `count` of them.
std::vector<double> nice_ticks(double low, double high, int count);
/// A number with as many decimals as ticks that far apart need, and no more than six.
std::string tick_label(double value, double step);
/// Four significant digits, no exponent where it can be helped.
std::string short_number(double value);

/// A figure's name as people write it: "mean_depth_std_m" becomes "mean depth std [m]".
std::string figure_title(const std::string& name);

/// Throws std::runtime_error that names the file.
void write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace topoloc::apps
