// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/ribbon.hpp"

#include <cmath>
#include <cstdint>

namespace topoloc::world {

std::vector<double> stations(double begin_m, double end_m, double step_m) {
  constexpr double kTiny_m = 1e-6;
  std::vector<double> result{begin_m};
  for (auto i = static_cast<std::int64_t>(std::floor(begin_m / step_m)) + 1;
       static_cast<double>(i) * step_m < end_m - kTiny_m; ++i) {
    if (static_cast<double>(i) * step_m > begin_m + kTiny_m) {
      result.push_back(static_cast<double>(i) * step_m);
    }
  }
  result.push_back(end_m);
  return result;
}

void ribbon(MeshBuilder& builder, const Frames& frames, const std::vector<double>& along_m,
            const CrossSection& across, std::uint32_t surface, bool from_line) {
  const auto same = [](const Across& a, const Across& b) {
    constexpr double kTiny_m = 1e-5;
    return std::abs(a.left_m - b.left_m) + std::abs(a.up_m - b.up_m) < kTiny_m;
  };
  std::vector<std::uint32_t> before;
  std::vector<Across> last;
  const RigidTransform outer = builder.frame();
  for (const double s : along_m) {
    builder.set_frame(outer * frames(s));
    const std::vector<Across> points = across(s);
    std::vector<std::uint32_t> row;
    double v = from_line ? points.front().left_m : 0.0;
    const double sign = from_line && points.back().left_m < points.front().left_m ? -1.0 : 1.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i > 0) {
        v += sign * std::hypot(points[i].left_m - points[i - 1].left_m,
                               points[i].up_m - points[i - 1].up_m);
      }
      row.push_back(builder.vertex(Point(0.0, points[i].left_m, points[i].up_m), Uv(s, v)));
    }
    for (std::size_t i = 0; i + 1 < before.size(); ++i) {
      if (same(points[i], points[i + 1]) && same(last[i], last[i + 1])) {
        continue;  // a lane that is not there
      }
      builder.face(before[i], row[i], row[i + 1], before[i + 1], surface);
    }
    before = std::move(row);
    last = points;
  }
  builder.set_frame(outer);
}

}  // namespace topoloc::world
