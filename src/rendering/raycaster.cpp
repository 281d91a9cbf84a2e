// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/raycaster.hpp"

#include "rendering/embree_handles.hpp"
#include "rendering/facet_of.hpp"
#include "rendering/ray_packet.hpp"
#include "rendering/triangle_hit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace topoloc::rendering {
namespace {

void check(const world::World& world) {
  for (std::size_t m = 0; m < world.meshes.size(); ++m) {
    const world::Mesh& mesh = world.meshes[m];
    for (const world::Triangle& triangle : mesh.triangles) {
      if (triangle.surface >= world.surfaces.size() ||
          *std::max_element(triangle.vertices.begin(), triangle.vertices.end()) >=
              mesh.vertices.size()) {
        throw std::invalid_argument("mesh " + std::to_string(m) +
                                    ": a triangle names a vertex or surface that is not there");
      }
    }
  }
}

void check(const world::World& world, std::span<const world::Instance> instances) {
  for (const world::Instance& instance : instances) {
    if (instance.mesh >= world.meshes.size()) {
      throw std::invalid_argument("an instance of mesh " + std::to_string(instance.mesh) + " of " +
                                  std::to_string(world.meshes.size()));
    }
  }
}

/// Embree's sign for a hit.
bool is_blocked(float tfar) { return std::isinf(tfar) && tfar < 0.0F; }

bool blocked_in(RTCScene scene, RTCRay ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
  return is_blocked(ray.tfar);
}

RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

struct Raycaster::Scene {
  const world::World* world = nullptr;
  Device device;
  std::vector<EmbreeScene> meshes;  // of prototypes; [0] is empty
  EmbreeScene fixed;
  EmbreeScene moving;
  std::vector<Placed> objects;  // by Hit::object
  std::uint32_t first_moving = 0;

  EmbreeScene make_scene(RTCBuildQuality quality) const {
    EmbreeScene scene(rtcNewScene(device.get()));
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), quality);
    return scene;
  }
  void add_triangles(RTCScene scene, const world::Mesh& mesh) const;
  void add_instance(RTCScene scene, const world::Instance& instance, std::uint32_t id) const;
  /// Those to look into; null: nothing there.
  [[nodiscard]] std::array<RTCScene, 2> among(Obstacles obstacles) const {
    return {obstacles == Obstacles::kFixed ? nullptr : moving.get(),
            obstacles == Obstacles::kMoving ? nullptr : fixed.get()};
  }
  void intersect(Packet& packet, Obstacles obstacles) const {
    for (RTCScene scene : among(obstacles)) {
      if (scene != nullptr) {
        RTCIntersectContext context = coherent();
        rtcIntersect16(packet.valid.data(), scene, &context, &packet.rays);
      }
    }
  }
  [[nodiscard]] Hit hit_of(const Ray& ray, const RTCHit& at, double embree_m) const;
};

void Raycaster::Scene::add_triangles(RTCScene scene, const world::Mesh& mesh) const {
  static_assert(sizeof(world::Vertex) == 5 * sizeof(float));
  static_assert(sizeof(world::Triangle) == 4 * sizeof(std::uint32_t));
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes of a vertex: its position and the first of its uv.
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             mesh.vertices.data(), 0, sizeof(world::Vertex), mesh.vertices.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             mesh.triangles.data(), 0, sizeof(world::Triangle),
                             mesh.triangles.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, 0);
  rtcReleaseGeometry(geometry);
}

void Raycaster::Scene::add_instance(RTCScene scene, const world::Instance& instance,
                                    std::uint32_t id) const {
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, meshes[instance.mesh].get());
  Eigen::Matrix<float, 3, 4> T;
  T << instance.scale * instance.T_world_mesh.R.cast<float>(),
      instance.T_world_mesh.p.cast<float>();
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, T.data());
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

Hit Raycaster::Scene::hit_of(const Ray& ray, const RTCHit& at, double embree_m) const {
  Hit hit;
  hit.object = at.instID[0] == RTC_INVALID_GEOMETRY_ID ? 0 : at.instID[0];
  hit.triangle = at.primID;
  const Placed& object = objects[hit.object];
  const PlaneHit exact = meet(object, hit.triangle, ray.origin_m, ray.direction, embree_m);
  hit.distance_m = exact.distance_m;
  hit.point_m = ray.origin_m + hit.distance_m * ray.direction;
  hit.normal = exact.normal.dot(ray.direction) > 0.0 ? -exact.normal : exact.normal;
  hit.uv_m = exact.uv_m;
  hit.surface = &world->surfaces[object.mesh->triangles[hit.triangle].surface];
  hit.instance = object.seed;
  hit.moving = hit.object >= first_moving;
  return hit;
}

Raycaster::Raycaster(const world::World& world, std::span<const world::Instance> parked)
    : scene_(std::make_unique<Scene>()) {
  check(world);
  check(world, world.instances);
  check(world, parked);
  if (world.meshes.empty()) {
    throw std::invalid_argument("a world without scenery (mesh 0)");
  }
  scene_->world = &world;
  // Built by one thread: trees of boxes that several build may differ, and with them which of two
  // triangles a ray hits on their common edge.
  scene_->device.reset(rtcNewDevice("threads=1,set_affinity=0"));
  if (!scene_->device) {
    throw std::runtime_error("Embree finds no device");
  }
  scene_->meshes.resize(world.meshes.size());
  for (std::size_t m = 1; m < world.meshes.size(); ++m) {
    scene_->meshes[m] = scene_->make_scene(RTC_BUILD_QUALITY_MEDIUM);
    scene_->add_triangles(scene_->meshes[m].get(), world.meshes[m]);
    rtcCommitScene(scene_->meshes[m].get());
  }
  scene_->fixed = scene_->make_scene(RTC_BUILD_QUALITY_MEDIUM);
  scene_->add_triangles(scene_->fixed.get(), world.meshes[0]);
  scene_->objects.push_back({world.meshes.data(), 0, 1.0, {}, {}});
  for (const auto& instances : {std::span<const world::Instance>(world.instances), parked}) {
    for (const world::Instance& instance : instances) {
      scene_->add_instance(scene_->fixed.get(), instance,
                           static_cast<std::uint32_t>(scene_->objects.size()));
      scene_->objects.push_back(placed(world, instance));
    }
  }
  rtcCommitScene(scene_->fixed.get());
  scene_->first_moving = static_cast<std::uint32_t>(scene_->objects.size());
}

Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;
Raycaster& Raycaster::operator=(Raycaster&&) noexcept = default;

void Raycaster::place_moving(std::span<const world::Instance> moving) {
  check(*scene_->world, moving);
  scene_->moving.reset();
  scene_->objects.resize(scene_->first_moving);
  if (moving.empty()) {
    return;
  }
  scene_->moving = scene_->make_scene(RTC_BUILD_QUALITY_LOW);
  for (const world::Instance& instance : moving) {
    scene_->add_instance(scene_->moving.get(), instance,
                         static_cast<std::uint32_t>(scene_->objects.size()));
    scene_->objects.push_back(placed(*scene_->world, instance));
  }
  rtcCommitScene(scene_->moving.get());
}

std::optional<Hit> Raycaster::cast(const Ray& ray, Obstacles obstacles) const {
  RTCRayHit found{};
  found.ray = embree_ray(ray);
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  for (RTCScene scene : scene_->among(obstacles)) {
    if (scene != nullptr) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(scene, &context, &found);  // shortens the ray: the moving ones hide the fixed
    }
  }
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
    return std::nullopt;
  }
  return scene_->hit_of(ray, found.hit, static_cast<double>(found.ray.tfar));
}

void Raycaster::cast(std::span<const Ray> rays, std::span<std::optional<Hit>> hits,
                     Obstacles obstacles) const {
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const auto part = rays.subspan(first, std::min(kPacket, rays.size() - first));
    Packet packet(part);
    scene_->intersect(packet, obstacles);
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (packet.rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
        hits[first + i].reset();
        continue;
      }
      RTCHit hit{};
      hit.primID = packet.rays.hit.primID[i];
      hit.instID[0] = packet.rays.hit.instID[0][i];
      hits[first + i] = scene_->hit_of(part[i], hit, static_cast<double>(packet.rays.ray.tfar[i]));
    }
  }
}

// With rtcIntersect16, not rtcOccluded16: some packets never return from that of Embree 3.13.5.
// Sixteen nearest hits still take less time than sixteen single questions whether there is one.
void Raycaster::blocked(std::span<const Ray> rays, std::span<std::uint8_t> results,
                        Obstacles obstacles) const {
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const auto part = rays.subspan(first, std::min(kPacket, rays.size() - first));
    Packet packet(part);
    scene_->intersect(packet, obstacles);
    for (std::size_t i = 0; i < part.size(); ++i) {
      results[first + i] = packet.rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
  }
}

bool Raycaster::blocked(const Ray& ray, Obstacles obstacles) const {
  const auto scenes = scene_->among(obstacles);
  return std::any_of(scenes.begin(), scenes.end(), [&](RTCScene scene) {
    return scene != nullptr && blocked_in(scene, embree_ray(ray));
  });
}

Facet Raycaster::facet(const Hit& hit) const {
  return facet_of(scene_->objects[hit.object], hit.triangle);
}

Eigen::Matrix<double, 2, 3> Raycaster::uv_per_metre(const Hit& hit) const {
  return rendering::uv_per_metre(scene_->objects[hit.object], hit.triangle);
}

const Eigen::Vector3d& Raycaster::place(const Hit& hit) const {
  return scene_->objects[hit.object].T_world_mesh.p;
}

bool Raycaster::near_moving(const Eigen::Vector3d& point_m, double within_m) const {
  return std::any_of(scene_->objects.begin() + scene_->first_moving, scene_->objects.end(),
                     [&](const Placed& object) {
                       return (object.T_world_mesh.p - point_m).squaredNorm() < within_m * within_m;
                     });
}

const world::World& Raycaster::world() const { return *scene_->world; }

Eigen::Vector3d off_surface(const Hit& hit) {
  constexpr double kLeast_m = 1e-3;
  constexpr double kPerMetre = 4e-7;  // a few times the rounding of a float
  return hit.point_m + (kLeast_m + kPerMetre * hit.point_m.cwiseAbs().maxCoeff()) * hit.normal;
}

}  // namespace topoloc::rendering
