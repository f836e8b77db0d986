// SPDX-License-Identifier: Apache-2.0
// How an image of any size lies in a network's input: whole, undistorted, with bars around it.
// Refuses to touch pixels.
#pragma once

#include <Eigen/Core>

namespace dsg::ingest {

/// Where the image lies in the input.
struct Letterbox {
  int image_width_px = 0;
  int image_height_px = 0;
  int left_px = 0;
  int top_px = 0;
  /// At least 1.
  int width_px = 0;
  int height_px = 0;

  /// From the input to the image, cut at the image's edges; boxes are left, top, right, bottom.
  Eigen::Vector4d ToImage(const Eigen::Vector4d& box_input) const;
};

/// The image as large as fits, in the middle. Requires: all four are positive.
Letterbox FitLetterbox(int image_width_px, int image_height_px, int input_width_px,
                       int input_height_px);

}  // namespace dsg::ingest
