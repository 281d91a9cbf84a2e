// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "summary.hpp"

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

nlohmann::json to_json(const replay::Lateness& lateness) {
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  return {{"p50_ms", ms(lateness.quantile_ns(0.5))},
          {"p99_ms", ms(lateness.quantile_ns(0.99))},
          {"max_ms", ms(lateness.max_ns())},
          {"later_than_5_ms", lateness.late_count()}};
}

std::string line(const nlohmann::json& late) {
  return fmt::format(
      "late by {:.2f} ms (median), {:.2f} ms (99 %), {:.2f} ms (most); {} later than "
      "5 ms\n",
      late["p50_ms"].get<double>(), late["p99_ms"].get<double>(), late["max_ms"].get<double>(),
      late["later_than_5_ms"].get<std::uint64_t>());
}

}  // namespace

nlohmann::json to_json(const Played& played) {
  nlohmann::json summary = {{"faults", nlohmann::json::array()}};
  if (played.can != nullptr) {
    const auto sent = static_cast<std::size_t>(can::SendVerdict::kSent);
    nlohmann::json not_sent = nlohmann::json::object();
    for (std::size_t i = 0; i < can::kSendVerdictCount; ++i) {
      if (i != sent && played.can->verdicts[i] > 0) {
        not_sent[can::name(static_cast<can::SendVerdict>(i))] = played.can->verdicts[i];
      }
    }
    summary["can"] = {{"frames", played.can->frames},
                      {"sent", played.can->verdicts[sent]},
                      {"not_sent", not_sent},
                      {"queue_waits", played.can->queue_waits},
                      {"lateness", to_json(played.can->lateness)}};
  }
  if (played.camera != nullptr) {
    summary["camera"] = {{"images", played.camera->images},
                         {"sent", played.camera->images - played.camera->failed},
                         {"lateness", to_json(played.camera->lateness)}};
  }
  for (std::size_t i = 0; i < played.script->faults.size(); ++i) {
    const replay::Fault& fault = played.script->faults[i];
    const bool camera = replay::concerns_camera(fault.kind);
    const std::uint64_t affected =
        camera ? played.camera_faults == nullptr ? 0 : played.camera_faults->affected()[i]
        : played.can_faults == nullptr ? 0
                                       : played.can_faults->affected()[i];
    summary["faults"].push_back({{"kind", replay::name(fault.kind)},
                                 {"at_s", 1e-9 * static_cast<double>(fault.from_ns)},
                                 {"until_s", 1e-9 * static_cast<double>(fault.until_ns)},
                                 {"affected", affected}});
  }
  return summary;
}

std::string to_text(const nlohmann::json& summary) {
  std::string text;
  if (summary.contains("can")) {
    const auto& can = summary["can"];
    text += fmt::format("CAN: {} of {} frames sent", can["sent"].get<std::uint64_t>(),
                        can["frames"].get<std::uint64_t>());
    for (const auto& [why, count] : can["not_sent"].items()) {
      text += fmt::format(", {}: {}", why, count.get<std::uint64_t>());
    }
    text += "; " + line(can["lateness"]);
  }
  if (summary.contains("camera")) {
    const auto& camera = summary["camera"];
    text += fmt::format("camera: {} of {} images sent; ", camera["sent"].get<std::uint64_t>(),
                        camera["images"].get<std::uint64_t>()) +
            line(camera["lateness"]);
  }
  for (const auto& fault : summary["faults"]) {
    text += fmt::format("fault {} from {:g} to {:g} s: {} affected\n",
                        fault["kind"].get<std::string>(), fault["at_s"].get<double>(),
                        fault["until_s"].get<double>(), fault["affected"].get<std::uint64_t>());
  }
  return text;
}

}  // namespace topoloc::apps
