// SPDX-License-Identifier: Apache-2.0
// Pictures made of formulas: a texture with corners everywhere, seen through a camera.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Grey levels of a plane: waves of 1 to 6.8 units in many directions.
inline double WaveTexture(double x, double y, double phase = 0.0) {
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2.4 * i;
    const double length = std::pow(1.19, i);
    sum += std::sin(2.0 * M_PI / length * (std::cos(angle) * x + std::sin(angle) * y) +
                    (1.7 + phase) * i);
  }
  return 128.0 + 18.0 * sum;
}

inline Image PaintedImage(int width, int height, const std::function<double(int, int)>& gray) {
  Image image{width, height, PixelFormat::kGray8, {}};
  image.bytes.resize(image.Offset(0, height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      image.bytes[image.Offset(u, v)] =
          static_cast<uint8_t>(std::clamp(gray(u, v), 0.0, 255.0) + 0.5);
    }
  }
  return image;
}

inline CameraCalibration ImageCamera(int width = 376, int height = 240) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.6 * width;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

}  // namespace dsg::ingest
