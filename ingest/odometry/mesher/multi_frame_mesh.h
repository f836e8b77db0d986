// SPDX-License-Identifier: Apache-2.0
// The meshes of the last keyframes as one: the surfaces around the robot, for avoiding obstacles
// before a volume is there.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/mesher/frame_mesh.h"
#include "ingest/odometry/mesher/mesher_options.h"
#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/sensor/calibration.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// In the odometry frame, metres. Vertices ascend by feature; all are of a face.
struct ObstacleMesh {
  std::vector<int64_t> feature_ids;
  std::vector<Eigen::Vector3d> vertices_odom;
  /// Indices of vertices; normals (right-hand rule) point to where the face was seen from.
  std::vector<std::array<uint32_t, 3>> faces;
};

/// The union of frame meshes over the window of the odometry, by landmark. Where a landmark moves,
/// its vertex does. A triangle ends
///  - with one of its landmarks, `horizon_ns` after that has left the window;
///  - when one is out of sight that fewer than `sight_count_min` keyframes have seen;
///  - when landmarks have moved so that it is too long or too thin;
///  - when the newest keyframe sees a landmark through it: there is nothing;
///  - when the newest keyframe sees all its corners and joins them otherwise (`is_renewed`).
///
/// It is for obstacles near the robot, and no layer of a map: it has holes where there are no
/// landmarks, and lies in the odometry frame, which drifts.
///
/// The same calls give the same mesh. Memory: the landmarks of the window. Cost: triangles times
/// the landmarks within them. Threads: one caller at a time.
/// Source: Rosinol, Sattler, Pollefeys and Carlone, ICRA 2019 (multi-frame mesh); the second
/// and the last two are not theirs.
class MultiFrameMesh {
 public:
  /// `camera` is rectified.
  /// Errors: FIELD_INVALID for a camera that is not valid, and for options out of range.
  static absl::StatusOr<MultiFrameMesh> Make(const CameraCalibration& camera,
                                             const MesherOptions& options);

  /// A keyframe later than the last one, with its pose and all landmarks of the window, ascending
  /// by id; `mask` as in MakeFrameMesh.
  /// Errors: FIELD_INVALID for a time that is not later, and of MakeFrameMesh; nothing changes.
  absl::Status Add(TimeNs time_ns, const Pose3d& odom_T_camera,
                   std::span<const SeenLandmark> landmarks, std::span<const uint8_t> mask);

  /// That of the last keyframe.
  const FrameMesh& frame() const { return frame_; }
  size_t triangle_count() const { return triangles_.size(); }
  size_t vertex_count() const { return vertices_.size(); }
  ObstacleMesh Mesh() const;

 private:
  struct Vertex {
    Eigen::Vector3d position_odom = Eigen::Vector3d::Zero();
    /// When the window had its landmark last.
    TimeNs told_ns = 0;
  };

  MultiFrameMesh(const CameraCalibration& camera, const MesherOptions& options)
      : camera_(camera), options_(options) {}
  void MoveVertices(TimeNs time_ns, std::span<const SeenLandmark> landmarks);
  void EndTriangles(const Pose3d& odom_T_camera);
  bool HasWrongShape(const MeshTriangle& triangle) const;
  bool IsRenewed(const MeshTriangle& triangle) const;
  bool IsSeenThrough(const MeshTriangle& triangle, const Pose3d& camera_T_odom,
                     std::span<const SeenLandmark* const> by_column) const;
  void AddFrameTriangles(TimeNs time_ns);

  CameraCalibration camera_;
  MesherOptions options_;
  FrameMesh frame_;
  TimeNs last_ns_ = kTimeMin;
  /// By feature.
  std::map<int64_t, Vertex> vertices_;
  std::set<MeshTriangle> triangles_;
};

}  // namespace dsg::ingest
