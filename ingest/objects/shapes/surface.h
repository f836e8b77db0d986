// SPDX-License-Identifier: Apache-2.0
// Points spread evenly over a CAD model's surface, as far as it can be seen from outside.
// Refuses to be random: the same model gives the same points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/objects/shapes/cad_model.h"

namespace dsg::ingest {

/// As many normals as points, unit, either way round.
struct Surface {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
};

/// Evenly spread over the area of all faces, about `count` points.
Surface SampleFaces(const CadModel& model, int count);

/// Without the points that nothing from outside reaches: models are often boxes pushed into each
/// other, whose inner faces no camera sees. Requires: points closer than half of `cell_m`.
Surface KeepOuter(const Surface& surface, double cell_m);

/// One point of each cell of a grid, the one nearest to the cell's middle; ascending by cell.
Surface ThinSurface(const Surface& surface, double cell_m);

/// The mean of the points in each cell of a grid; ascending by cell.
std::vector<Eigen::Vector3d> ThinPoints(const std::vector<Eigen::Vector3d>& points, double cell_m);

/// At most `count` of the points, evenly picked.
std::vector<Eigen::Vector3d> EveryNth(const std::vector<Eigen::Vector3d>& points, size_t count);

}  // namespace dsg::ingest
