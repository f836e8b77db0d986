// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/cell_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <tuple>
#include <vector>

namespace dsg::ingest {
namespace {

// Fewer points say nothing about a plane.
constexpr size_t kPlanePoints = 5;

Eigen::Vector3f FitNormal(const CellGraph& graph, const std::vector<int>& cells) {
  if (cells.size() < kPlanePoints) return Eigen::Vector3f::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int cell : cells) mean += graph.points_map[static_cast<size_t>(cell)].cast<double>();
  mean /= static_cast<double>(cells.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const int cell : cells) {
    const Eigen::Vector3d step = graph.points_map[static_cast<size_t>(cell)].cast<double>() - mean;
    spread += step * step.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  if (solver.info() != Eigen::Success) return Eigen::Vector3f::Zero();
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  const bool is_turned = std::tuple(normal.z(), normal.x(), normal.y()) < std::tuple(0.0, 0.0, 0.0);
  return (is_turned ? Eigen::Vector3d(-normal) : normal).cast<float>();
}

}  // namespace

void EstimateNormals(CellGraph* graph) {
  std::vector<int> around;
  for (size_t i = 0; i < graph->size(); ++i) {
    const int cell = static_cast<int>(i);
    around.assign(1, cell);
    for (const int near : graph->NeighboursOf(cell)) {
      around.push_back(near);
      for (const int next : graph->NeighboursOf(near)) around.push_back(next);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    graph->normals_map[i] = FitNormal(*graph, around);
  }
}

}  // namespace dsg::ingest
