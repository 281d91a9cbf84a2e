// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/map_builder.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "commands.hpp"
#include "common/initial_pose.hpp"
#include "common/log_damage.hpp"
#include "common/progress_bar.hpp"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace {

using namespace topoloc::mapping;

constexpr double kDegree = std::numbers::pi / 180.0;

struct Options {
  BuildPaths paths;
  BuildConfig config;
  std::string refine = "none";
  std::filesystem::path pair_model;
  std::filesystem::path registrations;
  std::string odometry;  // one kind so far
  std::string initial_pose;
  std::optional<double> trajectory_std_m;  // the default depends on --refine
  std::optional<double> trajectory_std_deg;
  std::uint64_t cloud_memory_mb = 1024;
  bool json = false;
};

std::map<std::string, std::size_t> rejected_by_reason(const BuildReport& report) {
  std::map<std::string, std::size_t> counts;
  for (const RejectedNode& node : report.rejected_nodes) {
    ++counts[std::string(name(node.reason))];
  }
  return counts;
}

void print_json(const Options& options, const BuildReport& report) {
  nlohmann::ordered_json rejected = nlohmann::ordered_json::array();
  for (const RejectedNode& node : report.rejected_nodes) {
    rejected.push_back(
        {{"frame", node.frame}, {"time_ns", node.time_ns}, {"reason", name(node.reason)}});
  }
  const nlohmann::ordered_json out{
      {"map", options.paths.out.string()},
      {"map_bytes", report.map_bytes},
      {"frames", report.frames},
      {"frames_rejected", report.frames_rejected},
      {"first_rejected_frame", report.first_frame_error},
      {"log_damage", topoloc::apps::to_json(report.log_damage)},
      {"frames_of_other_parity", report.selection.frames_of_other_parity},
      {"frames_without_pose", report.selection.frames_without_pose},
      {"keyframes", report.keyframes},
      {"travelled_m", report.selection.travelled_m},
      {"nodes", report.nodes_written},
      {"nodes_resumed", report.nodes_resumed},
      {"poses_resumed", report.poses_resumed},
      {"nodes_rejected", rejected},
      {"features", report.features},
      {"features_lifted", report.lifted},
      {"features_contradicted", report.contradicted},
      {"mean_depth_std_m", report.mean_depth_std_m},
      {"cloud_points", report.cloud_points},
      {"cloud_points_rejected", report.cloud_points_rejected},
      {"cloud_spacing_m", report.cloud_spacing_m},
      {"cloud_on_disk", report.cloud_on_disk},
      {"cloud_seconds", report.cloud_seconds},
      {"poses_seconds", report.poses_seconds},
      {"nodes_seconds", report.nodes_seconds},
      {"depths_seconds", report.depths_seconds}};
  std::cout << out.dump(2) << '\n';
}

/// What refinement took; empty without it.
std::string poses_time(const BuildReport& report) {
  if (report.keyframes == 0) {
    return "";
  }
  return report.poses_resumed ? "poses: taken over from an interrupted run; "
                              : fmt::format("poses: {:.1f} s; ", report.poses_seconds);
}

void print_summary(const Options& options, const BuildReport& report) {
  const auto nodes = static_cast<double>(report.nodes_written);
  fmt::print("{}: {} nodes on {:.0f} m, {:.1f} MB ({:.0f} kB a node with images)\n",
             options.paths.out.string(), report.nodes_written, report.selection.travelled_m,
             static_cast<double>(report.map_bytes) / 1e6,
             static_cast<double>(report.map_bytes) / 1e3 / nodes);
  fmt::print("features: {:.0f} a node, {:.1f} % with a 3D point, mean depth deviation {:.2f} m\n",
             static_cast<double>(report.features) / nodes,
             report.features == 0 ? 0.0
                                  : 100.0 * static_cast<double>(report.lifted) /
                                        static_cast<double>(report.features),
             report.mean_depth_std_m);
  fmt::print("frames: {} usable, {} of the other parity, {} without a pose", report.frames,
             report.selection.frames_of_other_parity, report.selection.frames_without_pose);
  fmt::print("{}\n", report.keyframes > 0
                         ? fmt::format(": poses are found for {} keyframes only", report.keyframes)
                         : "");
  for (const auto& [reason, count] : report.frames_rejected) {
    fmt::print("frames rejected, {}: {}\n", reason, count);
  }
  if (!report.first_frame_error.empty()) {
    fmt::print("first rejected frame: {}\n", report.first_frame_error);
  }
  fmt::print("{}", topoloc::apps::to_text(report.log_damage));
  for (const auto& [reason, count] : rejected_by_reason(report)) {
    fmt::print("nodes rejected, {}: {}\n", reason, count);
  }
  if (report.rejected_nodes.size() > report.nodes_written) {
    fmt::print(stderr,
               "topoloc-map: warning: most nodes were rejected; is the cloud of this place, and in "
               "the frame of the trajectory?\n");
  }
  for (const RejectedNode& node : report.rejected_nodes) {
    fmt::print("  frame {} at {} ns: {}\n", node.frame, node.time_ns, name(node.reason));
  }
  if (report.cloud_spacing_m > options.config.render.footprint_m) {
    fmt::print(stderr,
               "topoloc-map: warning: the cloud is sparse: what is behind a surface may show "
               "through it and give features a wrong depth\n");
  }
  fmt::print(
      "cloud: {} points ({} rejected), {:.1f} cm apart, {}{:.1f} s; {}nodes: {:.1f} s, "
      "{:.2f} s each",
      report.cloud_points, report.cloud_points_rejected, 100.0 * report.cloud_spacing_m,
      report.cloud_on_disk ? "sorted on disk, " : "", report.cloud_seconds, poses_time(report),
      report.nodes_seconds,
      report.nodes_made == 0 ? 0.0 : report.nodes_seconds / static_cast<double>(report.nodes_made));
  if (report.nodes_resumed > 0) {
    fmt::print(" ({} taken over from an interrupted run)", report.nodes_resumed);
  }
  fmt::print("\n");
}

/// A bar that appears with the first step, so that its clock does not run before.
Progress bar(const std::string& label) {
  const auto shown = std::make_shared<std::optional<topoloc::apps::ProgressBar>>();
  return [shown, label](double share) {
    if (!*shown) {
      shown->emplace(label);
    }
    (*shown)->update(share);
  };
}

/// How images are matched with the cloud: by the models of the drive, or by a detector-free one.
std::unique_ptr<topoloc::matching::ImagePairMatcher> pair_matcher(
    const Options& options, topoloc::matching::MatchingConfig config) {
  // Across the modalities networks are never sure; what is wrong is left out by geometry.
  config.min_match_score = std::min(config.min_match_score, 0.01);
  config.min_similarity = 0.0;
  if (config.matcher == "guided") {
    config.matcher = "mutual";  // its likeness without a prediction
  }
  return topoloc::matching::make_pair_matcher(config, options.pair_model);
}

/// Refines with what the options give: a trajectory, or an initial pose.
BuildReport build_refined(const Options& options, const BuildProgress& progress) {
  using topoloc::refinement::Routes;
  using topoloc::refinement::TrajectoryRefiner;
  const topoloc::drive::Drive drive = topoloc::drive::load_drive(options.paths.drive);
  topoloc::refinement::RefinementConfig config;
  config.frames = options.config.selection.frames;
  config.keyframe_m = std::min(config.keyframe_m, options.config.selection.every_m);
  config.prior_std_m = options.trajectory_std_m.value_or(config.prior_std_m);
  if (options.trajectory_std_deg) {
    config.prior_std_rad = *options.trajectory_std_deg * kDegree;
  }
  config.render = options.config.render;
  config.lift = options.config.lift;
  config.threads = options.config.threads;
  topoloc::refinement::PoseKnowledge knowledge;
  if (options.initial_pose.empty()) {
    knowledge.trajectory = topoloc::evaluation::read_tum(options.paths.trajectory);
  } else {
    knowledge.initial_pose = topoloc::apps::parse_initial_pose(options.initial_pose);
  }
  config.routes = topoloc::refinement::parse_routes(options.refine);
  std::unique_ptr<topoloc::matching::ImagePairMatcher> matcher;
  if (config.routes != Routes::kCorrelation) {
    matcher = pair_matcher(options, drive.vehicle.matching);
    config.matcher_files =
        topoloc::matching::pair_matcher_files(drive.vehicle.matching, options.pair_model);
  }
  TrajectoryRefiner refiner(drive, std::move(knowledge), config, std::move(matcher));
  const auto write_registrations = [&] {
    if (!options.registrations.empty()) {
      topoloc::refinement::write_registrations(options.registrations, refiner.attempts());
    }
  };
  try {
    BuildConfig build = options.config;
    build.take_over_poses = options.registrations.empty();  // nothing else knows of registrations
    BuildReport report = build_map(options.paths, build, progress, &refiner);
    write_registrations();
    return report;
  } catch (const std::exception&) {
    try {
      write_registrations();  // they show why
    } catch (const std::exception& error) {
      fmt::print(stderr, "topoloc-map: warning: {}\n", error.what());
    }
    throw;
  }
}

/// Throws CLI::ValidationError where options do not go together.
void check(const Options& options) {
  const bool refine = options.refine != "none";
  if (options.paths.trajectory.empty() == options.initial_pose.empty()) {
    throw CLI::ValidationError("--trajectory, --initial-pose", "give one of the two");
  }
  if (!refine && !options.initial_pose.empty()) {
    throw CLI::ValidationError("--initial-pose", "needs --refine auto, correlation or matches");
  }
  if (!refine && !options.odometry.empty()) {
    throw CLI::ValidationError("--odometry", "needs --refine auto, correlation or matches");
  }
  if (!refine && !options.registrations.empty()) {
    throw CLI::ValidationError("--registrations", "needs --refine auto, correlation or matches");
  }
  if (refine && (options.trajectory_std_m == 0.0 || options.trajectory_std_deg == 0.0)) {
    throw CLI::ValidationError("--trajectory-std-m, --trajectory-std-deg",
                               "must be above 0 where poses are to be refined");
  }
  if (!options.registrations.empty()) {
    // Before the work, not after it; what an earlier run wrote stays until this one is done.
    std::ofstream file(options.registrations, std::ios::app);
    if (!file) {
      throw CLI::ValidationError("--registrations",
                                 options.registrations.string() + ": cannot be written");
    }
  }
  if (options.refine != "auto" && options.refine != "matches" && !options.pair_model.empty()) {
    throw CLI::ValidationError("--pair-model", "needs --refine auto or matches");
  }
}

void run(Options& options) {
  check(options);
  options.config.trajectory_std_m =
      options.trajectory_std_m.value_or(options.config.trajectory_std_m);
  if (options.trajectory_std_deg) {
    options.config.trajectory_std_rad = *options.trajectory_std_deg * kDegree;
  }
  options.config.cloud_memory_bytes = options.cloud_memory_mb << 20U;
  options.config.creator = std::string("topoloc-map ") + TOPOLOC_VERSION;
  BuildProgress progress;
  progress.cloud = bar("cloud");
  progress.poses = bar("poses");
  progress.nodes = bar("nodes");
  progress.depths = bar("depths");
  const BuildReport report = options.refine == "none"
                                 ? build_map(options.paths, options.config, progress)
                                 : build_refined(options, progress);
  if (options.json) {
    print_json(options, report);
  } else {
    print_summary(options, report);
  }
}

}  // namespace

void add_build_command(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command =
      app.add_subcommand("build", "Makes a map from a point cloud and a camera drive");
  command->add_option("--drive", options->paths.drive, "Drive folder: camera.lcm, vehicle.yaml")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--cloud", options->paths.cloud, "Point cloud: .pcd, .ply, .las or .laz")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--trajectory", options->paths.trajectory,
                   "Poses of the drive in the cloud's frame (TUM, T_world_imu)")
      ->check(CLI::ExistingFile);
  command->add_option("--out,-o", options->paths.out, "Map to write (.tmap)")->required();
  command
      ->add_option("--refine", options->refine,
                   "none: take the trajectory as it is. Else find the poses by comparing camera "
                   "images and cloud (needs a cloud with intensities, and can.log): by the "
                   "correlation of gradients in windows of views, by matches of single views, or "
                   "auto: by both, where each is good")
      ->check(CLI::IsMember({"none", "auto", "correlation", "matches"}))
      ->capture_default_str();
  command
      ->add_option("--pair-model", options->pair_model,
                   "ONNX file of a detector-free network that matches camera images and LiDAR "
                   "intensities (docs/models.md), in place of the models that vehicle.yaml names")
      ->check(CLI::ExistingFile);
  command->add_option("--registrations", options->registrations,
                      "Write every registration that refinement tried here (CSV), also where the "
                      "build is then refused");
  command->add_option("--initial-pose", options->initial_pose,
                      "Instead of a trajectory: T_world_imu at the first inertial sample, "
                      "\"x y z qx qy qz qw\"; odometry leads on from there");
  command
      ->add_option("--odometry", options->odometry,
                   "What refinement knows of the motion between images [wheel-imu]")
      ->check(CLI::IsMember({"wheel-imu"}));
  command
      ->add_option("--every-metres", options->config.selection.every_m,
                   "Distance between nodes; turns of 15 degrees get one of their own")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  const std::map<std::string, FrameParity> parities{
      {"even", FrameParity::kEven}, {"odd", FrameParity::kOdd}, {"all", FrameParity::kAll}};
  command
      ->add_option("--frames", options->config.selection.frames,
                   "even, odd or all: frames to use by order number in camera.lcm, from 0 "
                   "[all]")
      ->transform(CLI::CheckedTransformer(parities));
  command
      ->add_option(
          "--trajectory-std-m", options->trajectory_std_m,
          "Standard deviation per axis of the trajectory, or the initial pose, against the "
          "cloud [0.02; 0.3 with refinement]")
      ->check(CLI::Range(0.0, 100.0));
  command
      ->add_option("--trajectory-std-deg", options->trajectory_std_deg,
                   "The same of its rotation [0.05; 1 with refinement]")
      ->check(CLI::Range(0.0, 90.0));
  command->add_option("--threads", options->config.threads, "Workers; 0: one per usable CPU")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command
      ->add_option(
          "--cloud-memory-mb", options->cloud_memory_mb,
          "Memory for the cloud; a larger one (36 bytes a point) is sorted on disk, in the "
          "folder of --out (16 to 32 bytes a point, gone at the end). Does not change the "
          "map")
      ->check(CLI::Range(64, 1'000'000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Report as JSON on stdout");
  command->footer(
      "A build that was interrupted goes on where it stopped when the same command is given "
      "again;\nits finished nodes wait in MAP.tmap.partial/, and its refined poses, once all are "
      "found\n(with --registrations they are looked for anew).\n"
      "Examples:\n"
      "  topoloc-map build --drive drive --cloud cloud.laz --trajectory drive/ground_truth.tum \\\n"
      "      --out town.tmap\n"
      "  topoloc-map build --drive drive --cloud cloud.pcd --trajectory prior.tum --out even.tmap "
      "\\\n      --frames even --every-metres 2\n"
      "  topoloc-map build --drive drive --cloud cloud.laz --trajectory gnss.tum --refine auto \\\n"
      "      --out town.tmap\n"
      "  topoloc-map build --drive drive --cloud cloud.laz --refine auto --odometry wheel-imu \\\n"
      "      --initial-pose \"12.5 -3.1 0.9 0 0 0.38 0.92\" --out tunnel.tmap");
  command->callback([options] { run(*options); });
}
