// SPDX-License-Identifier: Apache-2.0
// Which way the surfaces in a depth image face, tile by tile.
// Refuses tiles whose pixels do not lie on one plane.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "ingest/volume/fusion_options.h"

namespace dsg::ingest {

/// The inverse depth of a plane is linear in the image, so a plane is fitted by least squares
/// there: over 24 x 24 pixels where they agree, else over 8 x 8.
class SurfaceNormals {
 public:
  /// `reach`: metres along the optical axis, positive where there is a surface.
  SurfaceNormals(const std::vector<float>& reach, const CameraCalibration& camera,
                 const FusionOptions& options, int thread_count);

  /// Unit vector in the camera's frame that points away from the camera; zero = unknown.
  const Eigen::Vector3f& At(int column, int row) const {
    return normals_[static_cast<size_t>(row >> 3) * static_cast<size_t>(width_) +
                    static_cast<size_t>(column >> 3)];
  }

 private:
  int width_ = 0;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace dsg::ingest
