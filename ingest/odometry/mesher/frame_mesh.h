// SPDX-License-Identifier: Apache-2.0
// The landmarks that one keyframe sees, joined to a mesh: the surfaces before the camera.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/mesher/mesher_options.h"
#include "ingest/odometry/window/seen_landmark.h"
#include "ingest/sensor/calibration.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Ids of features, the least one first; counter-clockwise as the camera sees them, so that the
/// normal points to where the surface was seen from.
using MeshTriangle = std::array<int64_t, 3>;

/// What has become of the triangles of a frame; the first rule that a triangle breaks counts.
struct FrameMeshCounts {
  int kept = 0;
  int long_edge = 0;
  int thin = 0;
  int depth_jump = 0;
  int edge_on = 0;
  int masked = 0;
};

struct FrameMesh {
  /// Landmarks that were triangulated, ascending by id; all have a pixel.
  std::vector<SeenLandmark> corners;
  /// Those that pass all rules, ascending.
  std::vector<MeshTriangle> triangles;
  FrameMeshCounts counts;
};

/// The Delaunay triangulation, in the image, of the landmarks that the keyframe sees, each corner
/// where the landmark is in space. Left out are landmarks that are not before the camera or too far
/// off, and triangles that are long, thin, edge-on, bridge depths, or lie on
/// what the mask shows (as in FeatureTracker: what moves).
///
/// `camera` is rectified; `odom_T_camera` its pose at the keyframe. Landmarks ascend by id.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for a mask that does not fit the camera.
/// Cost: n log n of the corners, and with a mask its pixels. Threads: safe.
/// Source: Rosinol, Sattler, Pollefeys and Carlone, ICRA 2019 (per-frame mesh).
absl::StatusOr<FrameMesh> MakeFrameMesh(const CameraCalibration& camera,
                                        const Pose3d& odom_T_camera,
                                        std::span<const SeenLandmark> landmarks,
                                        std::span<const uint8_t> mask,
                                        const MesherOptions& options);

}  // namespace dsg::ingest
