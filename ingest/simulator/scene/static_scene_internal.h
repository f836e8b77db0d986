// SPDX-License-Identifier: Apache-2.0
// A scene made ready for rays: trees of triangles, and light, texture and names of each.
// Refuses callers outside of this folder's .cc files.
#pragma once

#include <vector>

#include "ingest/simulator/scene/embree_internal.h"
#include "ingest/simulator/scene/texture.h"

namespace dsg::simulator {

/// What shading needs of a triangle.
struct FaceLook {
  Eigen::Vector3f normal;
  /// Light on the corners.
  std::array<float, 3> light;
  /// Index of the part.
  int32_t part;
  /// Counted through all parts of the scene.
  int32_t face;
  /// Faces of one part that lie in one direction have one.
  int32_t surface;
  int32_t axis;
};

struct StaticScene {
  DeviceOwner device;
  RaySceneOwner opaque;
  /// Null without glass.
  RaySceneOwner glass;
  /// By Embree's numbers.
  std::vector<FaceLook> opaque_faces;
  std::vector<FaceLook> glass_faces;
  /// By part.
  std::vector<Surface> surfaces;
  std::vector<float> emissions;
  std::vector<uint16_t> labels;
  std::vector<RoomLight> lights;
};

absl::StatusOr<StaticScene> MakeStaticScene(const Scene& scene);

}  // namespace dsg::simulator
