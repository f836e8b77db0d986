// SPDX-License-Identifier: Apache-2.0
// Embree's handles as owners, and packets of eight rays through its scenes.
// Refuses callers outside of this folder's .cc files.
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

struct DeviceReleaser {
  void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};
struct SceneReleaser {
  void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};
using DeviceOwner = std::unique_ptr<RTCDeviceTy, DeviceReleaser>;
using RaySceneOwner = std::unique_ptr<RTCSceneTy, SceneReleaser>;

/// One that builds on the caller's thread alone, so that results never depend on scheduling.
absl::StatusOr<DeviceOwner> MakeDevice();

/// One geometry for each mesh, numbered in order. Errors: INTERNAL with what Embree says.
absl::StatusOr<RaySceneOwner> MakeRayScene(RTCDevice device,
                                           std::span<const TriangleMesh* const> meshes,
                                           RTCBuildQuality quality);

inline constexpr int kPacketSize = 8;

/// Eight rays from one point and what they hit. A direction's length is the unit of its distance.
struct Packet {
  alignas(32) std::array<int, kPacketSize> valid;
  RTCRayHit8 rays;

  void Reset(const Eigen::Vector3f& origin);
  void Set(int lane, const Eigen::Vector3f& direction);
  bool Hit(int lane) const { return rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID; }
  /// Looks for hits nearer than those there are.
  void Trace(RTCScene scene);
};

}  // namespace dsg::simulator
