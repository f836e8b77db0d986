// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detector/letterbox.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {

Letterbox FitLetterbox(int image_width_px, int image_height_px, int input_width_px,
                       int input_height_px) {
  const double scale = std::min(static_cast<double>(input_width_px) / image_width_px,
                                static_cast<double>(input_height_px) / image_height_px);
  const auto fit = [&](int image_px, int input_px) {
    return std::clamp(static_cast<int>(std::lround(scale * image_px)), 1, input_px);
  };
  Letterbox letterbox{.image_width_px = image_width_px, .image_height_px = image_height_px};
  letterbox.width_px = fit(image_width_px, input_width_px);
  letterbox.height_px = fit(image_height_px, input_height_px);
  letterbox.left_px = (input_width_px - letterbox.width_px) / 2;
  letterbox.top_px = (input_height_px - letterbox.height_px) / 2;
  return letterbox;
}

Eigen::Vector4d Letterbox::ToImage(const Eigen::Vector4d& box_input) const {
  // Each axis by itself, for sizes were rounded.
  const double scale_x = static_cast<double>(image_width_px) / width_px;
  const double scale_y = static_cast<double>(image_height_px) / height_px;
  const auto to_x = [&](double x) {
    return std::clamp((x - left_px) * scale_x, 0.0, static_cast<double>(image_width_px));
  };
  const auto to_y = [&](double y) {
    return std::clamp((y - top_px) * scale_y, 0.0, static_cast<double>(image_height_px));
  };
  return {to_x(box_input[0]), to_y(box_input[1]), to_x(box_input[2]), to_y(box_input[3])};
}

}  // namespace dsg::ingest
