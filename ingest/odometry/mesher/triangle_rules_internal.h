// SPDX-License-Identifier: Apache-2.0
// Which triangles of landmarks are surfaces.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

namespace dsg::ingest {

/// Corners of a triangle, metres, in one frame.
using Corners = std::array<Eigen::Vector3d, 3>;

double LongestEdge(const Corners& corners);
/// Height over the longest edge, a share of it: 0.87 of an equilateral triangle, 0 without area.
double AspectOf(const Corners& corners);
/// Depth of the farthest corner in units of that of the nearest one. Requires: corners in the frame
/// of the camera, before it.
double DepthRatioOf(const Corners& corners_camera);
/// Cosine of the angle between the normal and the ray to the middle, 0 to 1; 0 without area.
/// Requires: as above.
double FacingOf(const Corners& corners_camera);
/// Whether the normal (right-hand rule) points to the camera. Requires: as above.
bool TurnsToCamera(const Corners& corners_camera);

/// Whether a pixel of the triangle (its border counts) is not 0 in the mask of `width` columns; an
/// empty mask has none.
bool TouchesMask(const std::array<Eigen::Vector2d, 3>& pixels, std::span<const uint8_t> mask,
                 int width);

/// Depth of a triangle's plane at a pixel: 1 / depth is linear in pixels. 0 if the pixel is not
/// strictly inside.
double DepthWithin(const std::array<Eigen::Vector2d, 3>& pixels,
                   const std::array<double, 3>& depths, const Eigen::Vector2d& at);

}  // namespace dsg::ingest
