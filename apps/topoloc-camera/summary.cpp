// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "summary.hpp"

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

nlohmann::json to_json(const realtime::LatencyHistogram& histogram) {
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  return {{"p50_ms", ms(histogram.percentile_ns(0.5))},
          {"p99_ms", ms(histogram.percentile_ns(0.99))},
          {"max_ms", ms(histogram.max_ns())}};
}

}  // namespace

nlohmann::json to_json(const camera::BridgeSummary& summary, const camera::ImageSource& source) {
  nlohmann::json json = {{"published", summary.published},
                         {"publish_failed", summary.failed},
                         {"undecodable", summary.undecodable},
                         {"stamp_not_increasing", summary.not_increasing},
                         {"bytes", summary.bytes},
                         {"width_px", summary.size.width_px},
                         {"height_px", summary.size.height_px},
                         {"first_utime_us", summary.first_us},
                         {"last_utime_us", summary.last_us},
                         {"rate_hz", summary.rate_hz()},
                         {"period", to_json(summary.period)},
                         {"delay", to_json(summary.delay)},
                         {"losses", nlohmann::json::object()}};
  for (const auto& [name, count] : source.losses()) {
    json["losses"][name] = count;
  }
  return json;
}

std::string to_text(const nlohmann::json& summary) {
  const auto number = [&](const nlohmann::json& value) { return value.get<std::uint64_t>(); };
  std::string text = fmt::format("{} images of {}x{} published, {:.2f} a second, {:.1f} MB",
                                 number(summary["published"]), summary["width_px"].get<int>(),
                                 summary["height_px"].get<int>(), summary["rate_hz"].get<double>(),
                                 1e-6 * summary["bytes"].get<double>());
  for (const char* name : {"publish_failed", "undecodable", "stamp_not_increasing"}) {
    if (const std::uint64_t count = number(summary[name]); count > 0) {
      text += fmt::format(", {}: {}", name, count);
    }
  }
  for (const auto& [name, count] : summary["losses"].items()) {
    if (number(count) > 0) {
      text += fmt::format(", {}: {}", name, number(count));
    }
  }
  const auto& period = summary["period"];
  const auto& delay = summary["delay"];
  return text + fmt::format(
                    "\nstamp to stamp {:.1f} ms (median), {:.1f} ms (most); from mid-exposure to "
                    "LCM {:.1f} ms (median), {:.1f} ms (99 %), {:.1f} ms (most)\n",
                    period["p50_ms"].get<double>(), period["max_ms"].get<double>(),
                    delay["p50_ms"].get<double>(), delay["p99_ms"].get<double>(),
                    delay["max_ms"].get<double>());
}

}  // namespace topoloc::apps
