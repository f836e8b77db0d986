// SPDX-License-Identifier: Apache-2.0
// Delaunay triangulation of points of an image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace dsg::ingest {

/// Triangles of indices into `points`, each turning the same way and beginning with its least
/// index, ascending. Points that are not within the image (a pixel's border beyond it counts), and
/// the later ones of those at one place, are in none; thin triangles along the hull may be missing.
/// Places are rounded to single precision.
///
/// The same points in the same order give the same triangles. Cost: n log n on average.
/// Source: Guibas and Stolfi, 1985 (OpenCV's Subdiv2D).
std::vector<std::array<size_t, 3>> DelaunayOf(int width, int height,
                                              std::span<const Eigen::Vector2d> points);

}  // namespace dsg::ingest
