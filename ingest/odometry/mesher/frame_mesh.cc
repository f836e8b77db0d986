// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/mesher/frame_mesh.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/mesher/delaunay_internal.h"
#include "ingest/odometry/mesher/triangle_rules_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The count that a triangle belongs to; `kept` if it passes all rules.
int* VerdictOn(const Corners& corners_camera, const std::array<Vector2d, 3>& pixels,
               std::span<const uint8_t> mask, int width, const MesherOptions& options,
               FrameMeshCounts* counts) {
  if (LongestEdge(corners_camera) > options.edge_m_max) return &counts->long_edge;
  if (AspectOf(corners_camera) < options.aspect_min) return &counts->thin;
  if (DepthRatioOf(corners_camera) > options.depth_ratio_max) return &counts->depth_jump;
  if (FacingOf(corners_camera) < options.facing_min) return &counts->edge_on;
  if (TouchesMask(pixels, mask, width)) return &counts->masked;
  return &counts->kept;
}

}  // namespace

absl::StatusOr<FrameMesh> MakeFrameMesh(const CameraCalibration& camera,
                                        const Pose3d& odom_T_camera,
                                        std::span<const SeenLandmark> landmarks,
                                        std::span<const uint8_t> mask,
                                        const MesherOptions& options) {
  const size_t pixel_count = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
  if (!mask.empty() && mask.size() != pixel_count) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("the mask of a mesh of ", camera.name, " has ", mask.size(),
                                  " pixels; give ", pixel_count, " or none"),
                     {{"field", "mask"}, {"value", absl::StrCat(mask.size())}});
  }
  FrameMesh mesh;
  std::vector<Vector3d> points_camera;
  std::vector<Vector2d> pixels;
  const Pose3d camera_T_odom = odom_T_camera.Inverse();
  for (const SeenLandmark& landmark : landmarks) {
    if (!landmark.pixel.has_value()) continue;
    const Vector3d point_camera = camera_T_odom * landmark.position_odom;
    if (!(point_camera.z() > 0.0 && point_camera.z() <= options.farthest_m)) continue;
    mesh.corners.push_back(landmark);
    points_camera.push_back(point_camera);
    pixels.push_back(*landmark.pixel);
  }
  for (const std::array<size_t, 3>& face : DelaunayOf(camera.width, camera.height, pixels)) {
    const auto [a, b, c] = face;
    const Corners corners = {points_camera[a], points_camera[b], points_camera[c]};
    int* const count = VerdictOn(corners, {pixels[a], pixels[b], pixels[c]}, mask, camera.width,
                                 options, &mesh.counts);
    ++*count;
    if (count != &mesh.counts.kept) continue;
    // Corners ascend by id, so the least index is the least id.
    MeshTriangle triangle = {mesh.corners[a].feature_id, mesh.corners[b].feature_id,
                             mesh.corners[c].feature_id};
    if (!TurnsToCamera(corners)) std::swap(triangle[1], triangle[2]);
    mesh.triangles.push_back(triangle);
  }
  std::sort(mesh.triangles.begin(), mesh.triangles.end());
  return mesh;
}

}  // namespace dsg::ingest
