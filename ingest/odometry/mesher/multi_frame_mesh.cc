// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/mesher/multi_frame_mesh.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/mesher/triangle_rules_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

bool IsInOrder(const SeenLandmark& a, const SeenLandmark& b) { return a.feature_id < b.feature_id; }

bool HasId(const std::vector<SeenLandmark>& corners, int64_t id) {
  SeenLandmark wanted;
  wanted.feature_id = id;
  return std::binary_search(corners.begin(), corners.end(), wanted, IsInOrder);
}

}  // namespace

absl::StatusOr<MultiFrameMesh> MultiFrameMesh::Make(const CameraCalibration& camera,
                                                    const MesherOptions& options) {
  DSG_RETURN_IF_ERROR(camera.Validate());
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  return MultiFrameMesh(camera, options);
}

absl::Status MultiFrameMesh::Add(TimeNs time_ns, const Pose3d& odom_T_camera,
                                 std::span<const SeenLandmark> landmarks,
                                 std::span<const uint8_t> mask) {
  if (time_ns <= last_ns_) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("the keyframe at ", time_ns, " ns is not after the one at ",
                                  last_ns_, " ns; give a mesh its keyframes in order"),
                     {{"field", "time_ns"}, {"value", absl::StrCat(time_ns)}});
  }
  DSG_ASSIGN_OR_RETURN(FrameMesh frame,
                       MakeFrameMesh(camera_, odom_T_camera, landmarks, mask, options_));
  frame_ = std::move(frame);
  last_ns_ = time_ns;
  MoveVertices(time_ns, landmarks);
  EndTriangles(odom_T_camera);
  AddFrameTriangles(time_ns);
  // Vertices of no triangle.
  std::set<int64_t> used;
  for (const MeshTriangle& triangle : triangles_) used.insert(triangle.begin(), triangle.end());
  std::erase_if(vertices_, [&](const auto& entry) { return !used.contains(entry.first); });
  return absl::OkStatus();
}

void MultiFrameMesh::MoveVertices(TimeNs time_ns, std::span<const SeenLandmark> landmarks) {
  for (const SeenLandmark& landmark : landmarks) {
    const auto found = vertices_.find(landmark.feature_id);
    if (found == vertices_.end()) continue;
    const bool is_known =
        landmark.pixel.has_value() || landmark.sight_count >= options_.sight_count_min;
    if (is_known) {
      found->second = {landmark.position_odom, time_ns};
    } else {
      vertices_.erase(found);
    }
  }
  std::erase_if(vertices_, [&](const auto& entry) {
    return time_ns - entry.second.told_ns > options_.horizon_ns;
  });
}

void MultiFrameMesh::EndTriangles(const Pose3d& odom_T_camera) {
  const Pose3d camera_T_odom = odom_T_camera.Inverse();
  std::vector<const SeenLandmark*> by_column;
  for (const SeenLandmark& corner : frame_.corners) by_column.push_back(&corner);
  std::stable_sort(by_column.begin(), by_column.end(),
                   [](const auto* a, const auto* b) { return a->pixel->x() < b->pixel->x(); });
  std::erase_if(triangles_, [&](const MeshTriangle& triangle) {
    const bool is_whole = std::all_of(triangle.begin(), triangle.end(),
                                      [&](int64_t id) { return vertices_.contains(id); });
    return !is_whole || HasWrongShape(triangle) || IsRenewed(triangle) ||
           IsSeenThrough(triangle, camera_T_odom, by_column);
  });
}

bool MultiFrameMesh::HasWrongShape(const MeshTriangle& triangle) const {
  Corners corners;
  for (size_t i = 0; i < 3; ++i) corners[i] = vertices_.at(triangle[i]).position_odom;
  return LongestEdge(corners) > options_.edge_m_max || AspectOf(corners) < options_.aspect_min;
}

bool MultiFrameMesh::IsRenewed(const MeshTriangle& triangle) const {
  return options_.is_renewed != 0 && std::all_of(triangle.begin(), triangle.end(), [&](int64_t id) {
           return HasId(frame_.corners, id);
         });
}

bool MultiFrameMesh::IsSeenThrough(const MeshTriangle& triangle, const Pose3d& camera_T_odom,
                                   std::span<const SeenLandmark* const> by_column) const {
  std::array<Vector2d, 3> pixels;
  std::array<double, 3> depths{};
  for (size_t i = 0; i < 3; ++i) {
    const Vector3d corner = camera_T_odom * vertices_.at(triangle[i]).position_odom;
    // Of what is partly behind the camera nothing is told.
    if (!(corner.z() > 0.0)) return false;
    pixels[i] = Project(camera_, corner);
    depths[i] = corner.z();
  }
  const auto [left, right] = std::minmax({pixels[0].x(), pixels[1].x(), pixels[2].x()});
  auto next = std::lower_bound(
      by_column.begin(), by_column.end(), left,
      [](const SeenLandmark* landmark, double column) { return landmark->pixel->x() < column; });
  for (; next != by_column.end() && (*next)->pixel->x() <= right; ++next) {
    const SeenLandmark& landmark = **next;
    if (std::find(triangle.begin(), triangle.end(), landmark.feature_id) != triangle.end()) {
      continue;
    }
    const double depth = DepthWithin(pixels, depths, *landmark.pixel);
    const double seen_depth = (camera_T_odom * landmark.position_odom).z();
    if (depth > 0.0 && seen_depth > options_.through_ratio_min * depth) return true;
  }
  return false;
}

void MultiFrameMesh::AddFrameTriangles(TimeNs time_ns) {
  triangles_.insert(frame_.triangles.begin(), frame_.triangles.end());
  for (const SeenLandmark& corner : frame_.corners) {
    vertices_[corner.feature_id] = {corner.position_odom, time_ns};
  }
}

ObstacleMesh MultiFrameMesh::Mesh() const {
  ObstacleMesh mesh;
  std::map<int64_t, uint32_t> index_of;
  for (const auto& [id, vertex] : vertices_) {
    index_of.emplace(id, static_cast<uint32_t>(mesh.vertices_odom.size()));
    mesh.feature_ids.push_back(id);
    mesh.vertices_odom.push_back(vertex.position_odom);
  }
  for (const MeshTriangle& triangle : triangles_) {
    mesh.faces.push_back(
        {index_of.at(triangle[0]), index_of.at(triangle[1]), index_of.at(triangle[2])});
  }
  return mesh;
}

}  // namespace dsg::ingest
