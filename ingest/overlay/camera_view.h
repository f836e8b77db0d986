// SPDX-License-Identifier: Apache-2.0
// What a camera sees of points and lines of a map, and which of them the map's mesh hides.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// One stretch of a line in an image.
struct ImageStroke {
  /// Pixels, distortion applied.
  std::vector<Eigen::Vector2d> points_px;
  bool is_hidden = false;
};

/// A camera at one place in a map. Threads: one writer (AddMesh) or many readers.
class CameraView {
 public:
  CameraView(const CameraCalibration& camera, const Pose3d& map_T_camera);

  /// Hides what is behind these faces. Cost: that of drawing them.
  void AddMesh(const MeshBlock& block);

  /// A straight line, bent as the lens bends it, cut where it leaves the image and where it goes
  /// behind the mesh, by more than the errors of maps, or comes out.
  std::vector<ImageStroke> StrokesOf(const Eigen::Vector3d& from_map,
                                     const Eigen::Vector3d& to_map) const;
  const Eigen::Vector3d& center_map() const { return center_map_; }

 private:
  struct Seen {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    /// Along the optical axis, metres.
    double depth_m = 0.0;
  };
  // nullopt behind the camera, and where the lens model does not reach; may be outside the image.
  std::optional<Seen> See(const Eigen::Vector3d& point_map) const;
  bool IsInImage(const Eigen::Vector2d& pixel) const;
  // Requires: in the image.
  bool IsBehindMesh(const Seen& seen) const;
  void AddFace(const Seen& a, const Seen& b, const Seen& c);

  CameraCalibration camera_;
  Eigen::Vector3d center_map_;
  Pose3d camera_T_map_;
  double radius_max_;
  /// Of each pixel, the inverse of the nearest face's depth, 1/m; 0 = no face.
  std::vector<float> inverse_depth_;
};

}  // namespace dsg::ingest
