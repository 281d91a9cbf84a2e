#include "topoloc/refinement/trajectory_refiner.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>
using namespace topoloc;
int main(int argc, char** argv) {
  if (argc < 6) return 2;
  const auto drive = drive::load_drive(argv[1]);
  if (std::string(argv[3]) == "dr") {
    auto copy = drive;
    copy.vehicle.estimator.initial.gyro_bias_radps = std::stod(argv[6]);
    copy.vehicle.estimator.initial.attitude_rad = std::stod(argv[7]);
    const auto t =
        refinement::dead_reckon(copy, 0.0, evaluation::read_tum(argv[4]).front().T_world_imu);
    evaluation::write_tum(argv[5], t);
    return 0;
  }
  auto frames = drive::open_frames(drive);
  auto t0 = std::chrono::steady_clock::now();
  mapping::CloudGrid grid(mapping::load_point_cloud(argv[2]));
  std::fprintf(stderr, "cloud %.1f s\n",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count());
  refinement::PoseKnowledge knowledge;
  const auto trajectory = evaluation::read_tum(argv[4]);
  if (std::string(argv[3]) == "traj")
    knowledge.trajectory = trajectory;
  else
    knowledge.initial_pose = trajectory.front().T_world_imu;
  refinement::RefinementConfig config;
  t0 = std::chrono::steady_clock::now();
  refinement::TrajectoryRefiner refiner(drive, knowledge, config);
  const auto poses = refiner.refine(grid, frames, {});
  std::fprintf(stderr, "refine %.1f s for %zu keyframes\n",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count(),
               poses.size());
  std::ofstream out(argv[5]);
  out.precision(12);
  for (const auto& p : poses) {
    const auto q = p.T_world_imu.quaternion();
    if (p.frame % 20 == 0) {
      for (auto& [k, v] : p.figures) std::fprintf(stderr, "%s %.3f ", k.c_str(), v);
      std::fprintf(stderr, "\n");
    }
    out << p.time_ns << ' ' << p.T_world_imu.p.transpose() << ' ' << q.x() << ' ' << q.y() << ' '
        << q.z() << ' ' << q.w();
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) out << ' ' << p.covariance(i, j);
    out << ' ' << (p.rejected ? name(*p.rejected) : "-") << '\n';
  }
}
