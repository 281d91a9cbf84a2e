// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/map_builder.hpp"

#include "topoloc/drive/drive.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/map_writer.hpp"
#include "topoloc/mapping/cloud_cover.hpp"
#include "topoloc/mapping/map_report.hpp"
#include "topoloc/realtime/usable_cpus.hpp"

#include "mapping/build_journal.hpp"
#include "mapping/build_settings.hpp"
#include "mapping/cloud_reader.hpp"
#include "mapping/neighbour_check.hpp"
#include "mapping/node_maker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace topoloc::mapping {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Fails before the work starts where it could only fail after it.
void check_out(const std::filesystem::path& out) {
  const std::filesystem::path folder = std::filesystem::absolute(out).parent_path();
  if (!std::filesystem::is_directory(folder)) {
    fail(out, "its folder does not exist");
  }
  if (std::filesystem::is_directory(out)) {
    fail(out, "is a folder, not a map file");
  }
}

Selection plan_nodes(const BuildPaths& paths, const drive::FrameLog& frames,
                     const evaluation::Trajectory& trajectory, const SelectionConfig& config) {
  std::vector<std::int64_t> times_ns(frames.size());
  for (std::size_t i = 0; i < times_ns.size(); ++i) {
    times_ns[i] = frames.time_ns(i);
  }
  Selection selection = select_nodes(times_ns, trajectory, config);
  if (selection.nodes.empty()) {
    const auto span = [](std::int64_t from_ns, std::int64_t to_ns) {
      return std::to_string(from_ns / 1'000'000'000) + " to " +
             std::to_string(to_ns / 1'000'000'000) + " s";
    };
    fail(paths.trajectory, "gives no pose to any of the frames to use: it covers " +
                               span(trajectory.front().time_ns, trajectory.back().time_ns) +
                               ", the frames " + span(times_ns.front(), times_ns.back()));
  }
  return selection;
}

/// The same among the frames that a refiner gave a pose.
Selection plan_refined(const std::vector<RefinedPose>& poses, std::size_t frames,
                       SelectionConfig config) {
  const FrameParity parity = config.frames;
  config.frames = FrameParity::kAll;  // the refiner has chosen
  std::vector<std::int64_t> times_ns;
  evaluation::Trajectory trajectory;
  for (const RefinedPose& pose : poses) {
    times_ns.push_back(pose.time_ns);
    trajectory.push_back({pose.time_ns, pose.T_world_imu});
  }
  Selection selection = select_nodes(times_ns, trajectory, config);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    selection.frames_of_other_parity += is_used(frame, parity) ? 0 : 1;
  }
  selection.frames_without_pose = frames - selection.frames_of_other_parity - poses.size();
  for (PlannedNode& node : selection.nodes) {
    const RefinedPose& pose = poses[node.frame];
    node.frame = pose.frame;
    node.covariance = pose.covariance;
    node.rejected = pose.rejected;
    node.figures = pose.figures;
  }
  return selection;
}

/// Poses of the frames that a refiner looked at.
struct FoundPoses {
  std::vector<RefinedPose> poses;
  std::string settings;  // that they depend on
  bool resumed = false;  // found by an interrupted build
};

FoundPoses find_poses(const BuildPaths& paths, const std::filesystem::path& partial,
                      const BuildConfig& config, const config::VehicleConfig& vehicle,
                      const CloudGrid& grid, drive::FrameLog& frames, const Progress& progress,
                      PoseRefiner& refiner) {
  FoundPoses found;
  found.settings = describe_pose_settings(paths, vehicle, refiner);
  if (config.take_over_poses) {
    if (auto poses = BuildJournal::load_poses(partial, found.settings)) {
      found.poses = std::move(*poses);
      found.resumed = true;
      return found;
    }
  }
  found.poses = refiner.refine(grid, frames, progress);
  return found;
}

/// A cloud in another frame, or of another place, shows before any node is made.
void check_cloud_is_here(const BuildPaths& paths, const BuildConfig& config,
                         const config::VehicleConfig& vehicle, const CloudGrid& grid,
                         const Selection& selection) {
  std::vector<RigidTransform> T_world_imu;
  for (const PlannedNode& node : selection.nodes) {
    T_world_imu.push_back(node.T_world_imu);
  }
  const CloudCover cover =
      cloud_cover(grid, matching::matching_camera(vehicle.matching),
                  vehicle.camera.kalibr.T_imu_cam, T_world_imu, config.render.max_depth_m);
  if (cover.lies_elsewhere()) {
    fail(paths.cloud, cover.complaint());
  }
}

/// Makes all nodes that the journal does not hold yet, on all cores.
void make_nodes(const NodeContext& context, const std::vector<PlannedNode>& pending,
                std::size_t total, drive::FrameLog& frames, const BuildJournal& journal,
                const Progress& progress) {
  std::mutex mutex;  // guards frames, progress, done and failure
  std::size_t done = total - pending.size();
  std::exception_ptr failure;
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    try {
      NodeMaker maker(context);
      for (std::size_t i = next++; i < pending.size(); i = next++) {
        cv::Mat raw;
        {
          const std::lock_guard lock(mutex);
          if (failure) {
            return;
          }
          raw = frames.grey(pending[i].frame);
        }
        journal.store(pending[i].frame, maker.make(pending[i], raw));
        const std::lock_guard lock(mutex);
        ++done;
        if (progress) {
          progress(static_cast<double>(done) / static_cast<double>(total));
        }
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = failure ? failure : std::current_exception();
    }
  };
  const int wanted = context.config.threads > 0 ? context.config.threads : realtime::usable_cpus();
  const std::size_t workers = std::min(static_cast<std::size_t>(wanted), pending.size());
  {
    std::vector<std::jthread> pool;
    for (std::size_t i = 0; i < workers; ++i) {
      pool.emplace_back(work);
    }
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

/// Features whose depth the neighbouring nodes contradict, by the node's frame.
using ContradictedDepths = std::map<std::size_t, std::vector<std::size_t>>;

ContradictedDepths check_depths(const std::vector<PlannedNode>& nodes, const BuildJournal& journal,
                                const matching::MatchingConfig& matching,
                                const PinholeCamera& camera, const Progress& progress) {
  NeighbourCheck check(matching, camera);
  ContradictedDepths contradicted;
  const auto note = [&](std::optional<NeighbourCheck::Verdict> verdict) {
    if (verdict) {
      contradicted[verdict->frame] = std::move(verdict->features);
    }
  };
  std::size_t done = 0;
  for (const PlannedNode& node : nodes) {
    NodeOutcome outcome =
        node.rejected ? NodeOutcome{node.rejected, {}, {}} : journal.load(node.frame);
    if (!outcome.rejected) {
      note(check.next(node.frame, std::move(outcome.draft)));
    }
    ++done;
    if (progress) {
      progress(static_cast<double>(done) / static_cast<double>(nodes.size()));
    }
  }
  note(check.finish());
  return contradicted;
}

/// Features that have a depth.
struct Lifted {
  int count = 0;
  double depth_std_sum_m = 0.0;
};

/// Takes the depth from some of a node's features; too few that have one left reject it.
Lifted unlift(const std::vector<std::size_t>& features, int min_lifted, NodeOutcome& outcome) {
  for (const std::size_t i : features) {
    outcome.draft.features[i].depth_m = 0.0F;
    outcome.draft.features[i].depth_std_m = 0.0F;
  }
  Lifted left;
  for (const map::Feature& feature : outcome.draft.features) {
    left.count += feature.depth_m > 0.0F ? 1 : 0;
    left.depth_std_sum_m += static_cast<double>(feature.depth_std_m);
  }
  outcome.figures["contradicted"] = static_cast<double>(features.size());
  outcome.figures["lifted"] = left.count;
  outcome.figures["mean_depth_std_m"] = left.depth_std_sum_m / std::max(1, left.count);
  if (left.count < min_lifted) {
    outcome.rejected = NodeReject::kTooFewLifted;
  }
  return left;
}

/// Puts the journal's nodes into one map, in the order of the drive, and what became of each
/// planned one into the map's report, of which all but the nodes is given.
void assemble(const std::filesystem::path& out, const map::MapInfo& info,
              const BuildJournal& journal, const ContradictedDepths& contradicted, int min_lifted,
              MapReport map_report, BuildReport& report) {
  map::MapWriter writer(out, info);
  double depth_std_sum_m = 0.0;
  for (const PlannedNode& node : report.selection.nodes) {
    NodeOutcome outcome =
        node.rejected ? NodeOutcome{node.rejected, {}, {}} : journal.load(node.frame);
    Lifted lifted;
    if (!outcome.rejected) {
      lifted = unlift(contradicted.at(node.frame), min_lifted, outcome);
      report.contradicted += contradicted.at(node.frame).size();
    }
    NodeReport& node_report = map_report.nodes.emplace_back(
        NodeReport{node.frame, node.time_ns, node.T_world_imu.p, std::nullopt, node.figures});
    node_report.figures.insert(outcome.figures.begin(), outcome.figures.end());
    if (outcome.rejected) {
      node_report.rejected = name(*outcome.rejected);
      report.rejected_nodes.push_back({node.frame, node.time_ns, *outcome.rejected});
      continue;
    }
    writer.add(outcome.draft);
    ++report.nodes_written;
    report.features += outcome.draft.features.size();
    report.lifted += static_cast<std::uint64_t>(lifted.count);
    depth_std_sum_m += lifted.depth_std_sum_m;
  }
  if (report.nodes_written == 0) {
    fail(out, "not written: all " + std::to_string(report.selection.nodes.size()) +
                  " nodes were rejected (the first: " +
                  std::string(name(report.rejected_nodes.front().reason)) + ")");
  }
  writer.set_report(to_json(map_report));
  writer.finish();
  report.mean_depth_std_m =
      report.lifted > 0 ? depth_std_sum_m / static_cast<double>(report.lifted) : 0.0;
  report.map_bytes = std::filesystem::file_size(out);
}

}  // namespace

BuildReport build_map(const BuildPaths& paths, const BuildConfig& config,
                      const BuildProgress& progress, PoseRefiner* refiner) {
  BuildReport report;
  check_out(paths.out);
  // Of the drive only the camera matters here: no can.log is needed to make a map.
  drive::Drive drive;
  drive.dir = paths.drive;
  drive.vehicle = config::load_vehicle_config(paths.drive / "vehicle.yaml");
  drive::FrameLog frames = drive::open_frames(drive);
  report.frames = frames.size();
  if (!paths.trajectory.empty()) {
    report.selection =
        plan_nodes(paths, frames, evaluation::read_tum(paths.trajectory), config.selection);
  } else if (refiner == nullptr) {
    throw std::invalid_argument("a map needs a trajectory, or a refiner that finds one");
  }
  const map::ModelIdentity model = matching::make_extractor(drive.vehicle.matching)->identity();

  auto start = std::chrono::steady_clock::now();
  const CloudGrid grid = CloudGrid::load(
      paths.cloud, {config.cloud_memory_bytes, std::filesystem::absolute(paths.out).parent_path()},
      progress.cloud);
  const SortedCloud& cloud = grid.cloud();
  report.cloud_points = cloud.size();
  report.cloud_points_rejected = cloud.rejected();
  report.cloud_spacing_m = grid.median_spacing_m();
  report.cloud_on_disk = grid.spilled_runs() > 0;
  report.cloud_seconds = seconds_since(start);
  check_cloud_is_here(paths, config, drive.vehicle, grid, report.selection);
  std::filesystem::path partial = paths.out;
  partial += ".partial";
  FoundPoses found;
  if (refiner != nullptr) {
    start = std::chrono::steady_clock::now();
    found =
        find_poses(paths, partial, config, drive.vehicle, grid, frames, progress.poses, *refiner);
    report.selection = plan_refined(found.poses, frames.size(), config.selection);
    report.keyframes = found.poses.size();
    report.poses_resumed = found.resumed;
    report.poses_seconds = seconds_since(start);
  } else {
    Eigen::Matrix<double, 6, 1> std;
    std << Eigen::Vector3d::Constant(config.trajectory_std_rad),
        Eigen::Vector3d::Constant(config.trajectory_std_m);
    for (PlannedNode& node : report.selection.nodes) {
      node.covariance = std.cwiseAbs2().asDiagonal();
    }
  }

  map::MapInfo info;
  info.camera = matching::matching_camera(drive.vehicle.matching);
  info.T_imu_cam = drive.vehicle.camera.kalibr.T_imu_cam;
  info.model = model;
  info.crs = cloud.crs;
  info.creator = config.creator;

  const BuildJournal journal(
      partial, describe_settings(paths, config, drive.vehicle, info, report.selection.nodes), info);
  if (refiner != nullptr) {
    journal.store_poses(found.poses, found.settings);
  }
  std::vector<PlannedNode> pending;
  for (const PlannedNode& node : report.selection.nodes) {
    if (!node.rejected && !journal.contains(node.frame)) {
      pending.push_back(node);
    }
  }
  const auto refused = static_cast<std::size_t>(
      std::count_if(report.selection.nodes.begin(), report.selection.nodes.end(),
                    [](const PlannedNode& node) { return node.rejected.has_value(); }));
  report.nodes_resumed = report.selection.nodes.size() - refused - pending.size();
  report.nodes_made = pending.size();
  start = std::chrono::steady_clock::now();
  make_nodes({grid, drive.vehicle, config}, pending, report.selection.nodes.size() - refused,
             frames, journal, progress.nodes);
  report.nodes_seconds = seconds_since(start);

  // Always through the journal, so that a resumed build cannot differ from an uninterrupted one.
  MapReport map_report;
  map_report.creator = config.creator;
  map_report.refine = refiner != nullptr ? refiner->name() : "none";
  map_report.cloud_points = cloud.size();
  map_report.cloud_has_intensity = cloud.has_intensity;
  start = std::chrono::steady_clock::now();
  const ContradictedDepths contradicted = check_depths(
      report.selection.nodes, journal, drive.vehicle.matching, info.camera, progress.depths);
  report.depths_seconds = seconds_since(start);
  assemble(paths.out, info, journal, contradicted, config.min_lifted, std::move(map_report),
           report);
  journal.remove();
  report.frames_rejected = frames.rejected();
  report.first_frame_error = frames.first_error();
  report.log_damage = frames.damage();
  return report;
}

}  // namespace topoloc::mapping
