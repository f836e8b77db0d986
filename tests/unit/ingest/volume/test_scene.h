// SPDX-License-Identifier: Apache-2.0
// Scenes of a few shapes whose distance is known everywhere, and depth frames of them.
// Refuses to be a simulator: no noise of its own, no light, no texture.
#pragma once

#include <functional>
#include <vector>

#include "ingest/sensor/depth_frame.h"
#include "ingest/volume/semantic_volume.h"

namespace dsg::ingest {

struct TestShape {
  /// Signed, negative inside.
  std::function<double(const Eigen::Vector3d&)> distance;
  uint16_t label = 0;
  std::array<uint8_t, 3> rgb{200, 200, 200};
  bool is_person = false;
};

TestShape Ball(const Eigen::Vector3d& center, double radius);
TestShape SolidBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
/// Solid everywhere but inside the box.
TestShape RoomOf(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

struct TestScene {
  std::vector<TestShape> shapes;

  double DistanceTo(const Eigen::Vector3d& point_map) const;
  /// What a camera would see, found by stepping along each ray by the distance.
  DepthFrame Render(const CameraCalibration& camera, const Pose3d& map_T_camera) const;
};

/// 160 x 120 pixels, 82 degrees wide.
CameraCalibration SmallCamera();
/// Looks from `eye` at `target`, upright.
Pose3d LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

/// All vertices and faces of some blocks as one mesh; blocks of the same index replace earlier
/// ones, so it can be fed from several calls.
class CollectedMesh {
 public:
  void Take(SemanticVolume* volume, double block_size_m = 2.0);
  const std::vector<MeshBlock>& blocks() const { return blocks_; }
  size_t vertex_count() const;
  size_t face_count() const;
  /// Largest and root mean square distance of the vertices from the scene's surface.
  double WorstError(const TestScene& scene) const;
  double RmsError(const TestScene& scene) const;
  /// Vertices within a distance of a point.
  size_t CountNear(const Eigen::Vector3d& point_map, double radius_m) const;

 private:
  std::vector<MeshBlock> blocks_;
};

}  // namespace dsg::ingest
