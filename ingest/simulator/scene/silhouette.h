// SPDX-License-Identifier: Apache-2.0
// Which pixels a mesh would cover if it were alone, also beyond the borders of the image.
// Refuses depth: nothing hides anything here.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// Columns and rows, both ends included; empty when max < min.
struct PixelBox {
  int column_min = 0;
  int row_min = 0;
  int column_max = -1;
  int row_max = -1;

  bool IsEmpty() const { return column_max < column_min || row_max < row_min; }
  bool Intersects(const PixelBox& other) const {
    return column_min <= other.column_max && other.column_min <= column_max &&
           row_min <= other.row_max && other.row_min <= row_max;
  }
};

/// The camera's image.
PixelBox ImageBox(const ingest::CameraCalibration& camera);
/// The image with half of its width and height more on each side.
PixelBox GrownBox(const ingest::CameraCalibration& camera);

/// A box within GrownBox that holds the projection of all points; empty if none can be seen.
PixelBox ProjectedBox(const std::vector<Eigen::Vector3f>& points_camera,
                      const ingest::CameraCalibration& camera);

/// Counts pixels of GrownBox whose centre lies within the projection of some face. Faces behind
/// the camera are cut off.
///
/// Threads: one caller at a time; keeps its mask between calls.
class Silhouette {
 public:
  explicit Silhouette(const ingest::CameraCalibration& camera);
  int CountPixels(const std::vector<Eigen::Vector3f>& points_camera,
                  const std::vector<std::array<uint32_t, 3>>& faces, const PixelBox& box);

 private:
  void Fill(const std::array<Eigen::Vector2f, 3>& corners);
  void FillRow(int row, float from, float to);

  const ingest::CameraCalibration& camera_;
  const PixelBox grown_;
  const int width_;
  std::vector<uint8_t> mask_;
  PixelBox box_;
  int count_ = 0;
};

}  // namespace dsg::simulator
