// SPDX-License-Identifier: Apache-2.0
// The body of an agent at an instant, in the frame of the map, as files and pictures take it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"
#include "schema/model/mesh.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

using BodyFaces = std::vector<std::array<uint32_t, 3>>;

struct Body {
  TimeNs time_ns = 0;
  Pose3d map_T_agent;
  std::vector<Eigen::Vector3f> points_map;
  std::vector<Eigen::Vector3f> joints_map;
  /// Shared by the bodies of a topology, indices into points_map; null without one, then there are
  /// points only.
  std::shared_ptr<const BodyFaces> faces;

  size_t face_count() const { return faces == nullptr ? 0 : faces->size(); }
};

/// Those of an agent, ascending in time.
struct AgentBodies {
  NodeId agent;
  /// 0xRRGGBB.
  uint32_t rgb = 0;
  std::vector<Body> bodies;
};

/// All in one colour.
MeshBlock MeshOf(const Body& body, uint32_t rgb);

/// A face of a body with the light on it.
struct LitFace {
  std::array<Eigen::Vector3d, 3> corners_map;
  Eigen::Vector3d middle_map = Eigen::Vector3d::Zero();
  picture::Paint paint;
};

/// The faces that look towards the eye; `to_eye_map` is the unit direction to it, where the light
/// is too.
std::vector<LitFace> LitFaces(const Body& body, uint32_t rgb, const Eigen::Vector3d& to_eye_map);

}  // namespace dsg::cli
