// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/scene/embree_internal.h"

namespace dsg::simulator {
namespace {

absl::Status Failure(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("Embree could not ", what, " (error ", static_cast<int>(error),
                   error == RTC_ERROR_OUT_OF_MEMORY ? ", out of memory" : "", ")"));
}

void AttachMesh(RTCDevice device, RTCScene scene, const TriangleMesh& mesh, unsigned id,
                RTCBuildQuality quality) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, quality);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* faces = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                        sizeof(std::array<uint32_t, 3>), mesh.faces.size());
  if (vertices != nullptr && faces != nullptr) {
    std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
    std::memcpy(faces, mesh.faces.data(), mesh.faces.size() * sizeof(std::array<uint32_t, 3>));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
  }
  rtcReleaseGeometry(geometry);
}

}  // namespace

absl::StatusOr<DeviceOwner> MakeDevice() {
  // One width of vectors on all machines that have it, so that they round alike.
  DeviceOwner device(rtcNewDevice("threads=1,max_isa=avx2"));
  if (device == nullptr) {
    return absl::InternalError(absl::StrCat("Embree could not make a device (error ",
                                            static_cast<int>(rtcGetDeviceError(nullptr)), ")"));
  }
  return device;
}

absl::StatusOr<RaySceneOwner> MakeRayScene(RTCDevice device,
                                           std::span<const TriangleMesh* const> meshes,
                                           RTCBuildQuality quality) {
  RaySceneOwner scene(rtcNewScene(device));
  if (scene == nullptr) return Failure(device, "make a scene");
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene.get(), quality);
  for (size_t i = 0; i < meshes.size(); ++i) {
    AttachMesh(device, scene.get(), *meshes[i], static_cast<unsigned>(i), quality);
  }
  rtcCommitScene(scene.get());
  if (absl::Status status = Failure(device, "build a scene"); !status.ok()) return status;
  return scene;
}

void Packet::Reset(const Eigen::Vector3f& origin) {
  valid.fill(0);
  for (int lane = 0; lane < kPacketSize; ++lane) {
    rays.ray.org_x[lane] = origin.x();
    rays.ray.org_y[lane] = origin.y();
    rays.ray.org_z[lane] = origin.z();
    rays.ray.dir_x[lane] = 0.0f;
    rays.ray.dir_y[lane] = 0.0f;
    rays.ray.dir_z[lane] = 1.0f;
    rays.ray.tnear[lane] = 0.0f;
    rays.ray.tfar[lane] = std::numeric_limits<float>::infinity();
    rays.ray.time[lane] = 0.0f;
    rays.ray.mask[lane] = ~0u;
    rays.ray.id[lane] = 0;
    rays.ray.flags[lane] = 0;
    rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
}

void Packet::Set(int lane, const Eigen::Vector3f& direction) {
  valid[lane] = -1;
  rays.ray.dir_x[lane] = direction.x();
  rays.ray.dir_y[lane] = direction.y();
  rays.ray.dir_z[lane] = direction.z();
}

void Packet::Trace(RTCScene scene) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid.data(), scene, &context, &rays);
}

}  // namespace dsg::simulator
