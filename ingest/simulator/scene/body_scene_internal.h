// SPDX-License-Identifier: Apache-2.0
// The moving bodies that one image can show, made ready for rays.
// Refuses bodies outside of the image; they cost a projection and nothing more.
#pragma once

#include <span>
#include <vector>

#include "ingest/simulator/scene/embree_internal.h"
#include "ingest/simulator/scene/renderer.h"
#include "ingest/simulator/scene/silhouette.h"
#include "ingest/simulator/scene/static_scene_internal.h"

namespace dsg::simulator {

/// Where a camera is, in the numbers that rays are made of.
struct RayCamera {
  const ingest::CameraCalibration& calibration;
  Eigen::Vector3f origin_map;
  /// Columns: the camera's axes in the map.
  Eigen::Matrix3f map_R_camera;

  /// Of length 1 along the optical axis, so that distances along it are depths.
  Eigen::Vector3f Direction(float column, float row) const {
    const Eigen::Vector3f direction(
        (column - static_cast<float>(calibration.cx)) / static_cast<float>(calibration.fx),
        (row - static_cast<float>(calibration.cy)) / static_cast<float>(calibration.fy), 1.0f);
    return map_R_camera * direction;
  }
};

/// Point of a face, by the weights of its second and third corner.
struct FacePoint {
  uint32_t face = 0;
  float u = 0.0f;
  float v = 0.0f;
};

class BodyScene {
 public:
  /// Counts `coverage` if it is not null; its elements are those of `bodies`.
  static absl::StatusOr<BodyScene> Make(const StaticScene& world, const RayCamera& camera,
                                        std::span<const MovingBody> bodies,
                                        std::vector<BodyCoverage>* coverage);

  /// Null when the image shows none.
  RTCScene scene() const { return scene_.get(); }
  bool MayCover(const PixelBox& pixels) const;
  /// Index in `bodies` of Embree's geometry.
  int BodyOf(uint32_t geometry) const { return seen_[geometry].index; }
  uint16_t LabelOf(uint32_t geometry) const;
  Eigen::Vector3f ColorAt(uint32_t geometry, const FacePoint& at, float footprint_m) const;

 private:
  struct SeenBody {
    const MovingBody* body = nullptr;
    int index = 0;
    PixelBox box;
    Surface surface;
    /// Of each vertex.
    std::vector<float> light;
  };

  std::vector<SeenBody> seen_;
  RaySceneOwner scene_;
};

/// Errors: FIELD_INVALID naming the body, for lists that do not fit its mesh.
absl::Status CheckBodies(std::span<const MovingBody> bodies);

}  // namespace dsg::simulator
