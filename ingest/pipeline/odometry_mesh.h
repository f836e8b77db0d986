// SPDX-License-Identifier: Apache-2.0
// The mesh of obstacles beside a log's odometry: fed at keyframes, written when the log ends.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "ingest/odometry/mesher/multi_frame_mesh.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// The mesh after a keyframe.
struct MeshMoment {
  TimeNs time_ns = 0;
  Pose3d odom_T_body;
  const MultiFrameMesh* mesh = nullptr;
  /// Processor time that the keyframe took; no part of any result.
  double seconds = 0.0;
};

struct OdometryMeshOptions {
  MesherOptions mesher;
  /// Where the mesh of the last keyframe is written as PLY when the log ends; empty = nowhere.
  std::string file;
  /// Called after each keyframe; may be empty.
  std::function<void(const MeshMoment& moment)> on_keyframe;
};

/// Threads: one caller at a time.
class OdometryMesh {
 public:
  /// `camera` is the rectified left one. Errors: of MultiFrameMesh::Make; FIELD_INVALID when no
  /// file can be made at that path, now and not after hours of a log.
  static absl::StatusOr<OdometryMesh> Make(const CameraCalibration& camera,
                                           const OdometryMeshOptions& options);

  /// As MultiFrameMesh::Add, with the pose of the body. A keyframe that is refused is counted.
  void Add(TimeNs time_ns, const Pose3d& odom_T_body, std::span<const SeenLandmark> landmarks,
           std::span<const uint8_t> mask);

  /// Writes the file, if there is to be one. Errors: of WriteAtomically.
  absl::Status Write() const;
  /// Keyframes, sizes, and the processor time of a keyframe.
  std::string Note() const;

 private:
  OdometryMesh(MultiFrameMesh mesh, const CameraCalibration& camera, OdometryMeshOptions options)
      : mesh_(std::move(mesh)),
        body_T_camera_(camera.body_T_camera),
        options_(std::move(options)) {}

  MultiFrameMesh mesh_;
  Pose3d body_T_camera_;
  OdometryMeshOptions options_;
  int64_t keyframe_count_ = 0;
  int64_t refused_count_ = 0;
  size_t vertex_sum_ = 0;
  size_t triangle_sum_ = 0;
  double seconds_sum_ = 0.0;
  double seconds_longest_ = 0.0;
};

}  // namespace dsg::ingest
