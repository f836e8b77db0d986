// SPDX-License-Identifier: Apache-2.0
// The cells of a surface with their normals and neighbours.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "ingest/objects/surface_cells.h"

namespace dsg::ingest {

struct CellGraph {
  double cell_m = 0.0;
  std::vector<Eigen::Vector3f> points_map;
  /// Unit; zero where unknown. Towards where the surface was seen from, if is_oriented.
  std::vector<Eigen::Vector3f> normals_map;
  /// False where the mesh had no normals: then nobody knows which side was seen.
  bool is_oriented = true;
  /// Neighbours of cell i, ascending: neighbours[first[i]] up to neighbours[first[i + 1]].
  std::vector<int> first;
  std::vector<int> neighbours;

  size_t size() const { return points_map.size(); }
  /// Of the angle between two normals; turned ones count as the same where nothing is oriented.
  double Cosine(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return is_oriented ? a.dot(b) : std::abs(a.dot(b));
  }
  double CosineOf(int a, int b) const {
    return Cosine(normals_map[static_cast<size_t>(a)].cast<double>(),
                  normals_map[static_cast<size_t>(b)].cast<double>());
  }
  /// The normal of a cell, turned to look as `other` where nothing is oriented.
  Eigen::Vector3d NormalAs(const Eigen::Vector3d& other, int cell) const {
    const Eigen::Vector3d normal = normals_map[static_cast<size_t>(cell)].cast<double>();
    return is_oriented || normal.dot(other) >= 0.0 ? normal : Eigen::Vector3d(-normal);
  }
  std::span<const int> NeighboursOf(int cell) const {
    const auto begin = static_cast<size_t>(first[static_cast<size_t>(cell)]);
    const auto end = static_cast<size_t>(first[static_cast<size_t>(cell) + 1]);
    return {neighbours.data() + begin, end - begin};
  }
};

/// Neighbours are the up to 26 cells around. Normals are the means of the vertices', or estimated
/// if no vertex has one, and smoothed over neighbours within an angle of `same_face_cosine`.
/// Requires: a surface of one class, in cells of `cell_m`.
CellGraph MakeCellGraph(const ObjectSurface& surface, double cell_m, double same_face_cosine);

}  // namespace dsg::ingest
