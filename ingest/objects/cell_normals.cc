// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/cell_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>
#include <span>
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

/// Goes over the surface from cells of which the side is known, over the surest steps first.
class Orienter {
 public:
  explicit Orienter(CellGraph* graph) : graph_(*graph), is_done_(graph->size(), false) {}

  bool IsDone(int cell) const { return is_done_[static_cast<size_t>(cell)]; }

  void Start(int cell, const Eigen::Vector3f& side) {
    if (graph_.normals_map[static_cast<size_t>(cell)].dot(side) < 0.0f) Turn(cell);
    Finish(cell);
  }

  void Run() {
    while (!open_.empty()) {
      const auto [weight, from, to] = *open_.begin();
      open_.erase(open_.begin());
      if (IsDone(to)) continue;
      if (Expected(from, to).dot(graph_.normals_map[static_cast<size_t>(to)]) < 0.0f) Turn(to);
      Finish(to);
    }
  }

 private:
  void Turn(int cell) {
    Eigen::Vector3f& normal = graph_.normals_map[static_cast<size_t>(cell)];
    normal = -normal;
  }

  // The normal of a cell, mirrored at the plane midway to its neighbour: on a circle or a straight
  // line through both that is the neighbour's.
  Eigen::Vector3f Expected(int from, int to) const {
    const Eigen::Vector3f& normal = graph_.normals_map[static_cast<size_t>(from)];
    const Eigen::Vector3f step =
        (graph_.points_map[static_cast<size_t>(to)] - graph_.points_map[static_cast<size_t>(from)])
            .normalized();
    return normal - 2.0f * normal.dot(step) * step;
  }

  void Finish(int cell) {
    is_done_[static_cast<size_t>(cell)] = true;
    for (const int other : graph_.NeighboursOf(cell)) {
      if (IsDone(other)) continue;
      const float weight =
          1.0f -
          std::abs(Expected(cell, other).dot(graph_.normals_map[static_cast<size_t>(other)]));
      open_.emplace(weight, cell, other);
    }
  }

  CellGraph& graph_;
  std::vector<bool> is_done_;
  std::set<std::tuple<float, int, int>> open_;
};

/// All cells that hang together with a cell, and that one.
std::vector<int> PieceOf(const CellGraph& graph, int seed) {
  std::vector<int> piece = {seed};
  std::set<int> seen = {seed};
  for (size_t next = 0; next < piece.size(); ++next) {
    for (const int other : graph.NeighboursOf(piece[next])) {
      if (seen.insert(other).second) piece.push_back(other);
    }
  }
  return piece;
}

}  // namespace

void OrientNormals(const std::vector<Eigen::Vector3f>& sides, CellGraph* graph) {
  Orienter orienter(graph);
  for (int i = 0; i < static_cast<int>(graph->size()); ++i) {
    const Eigen::Vector3f& side = sides[static_cast<size_t>(i)];
    if (!side.isZero()) orienter.Start(i, side);
  }
  orienter.Run();
  for (int i = 0; i < static_cast<int>(graph->size()); ++i) {
    if (orienter.IsDone(i)) continue;
    const std::vector<int> piece = PieceOf(*graph, i);
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    for (const int cell : piece) middle += graph->points_map[static_cast<size_t>(cell)];
    middle /= static_cast<float>(piece.size());
    const auto distance = [&](int cell) {
      return (graph->points_map[static_cast<size_t>(cell)] - middle).squaredNorm();
    };
    const int outermost = *std::max_element(
        piece.begin(), piece.end(), [&](int a, int b) { return distance(a) < distance(b); });
    orienter.Start(outermost, graph->points_map[static_cast<size_t>(outermost)] - middle);
    orienter.Run();
  }
  graph->is_oriented = true;
}

void EstimateNormals(CellGraph* graph) {
  std::vector<int> around;
  for (size_t i = 0; i < graph->size(); ++i) {
    const int cell = static_cast<int>(i);
    const std::span<const int> near = graph->NeighboursOf(cell);
    around.assign(near.begin(), near.end());
    around.push_back(cell);
    for (const int other : near) {
      for (const int next : graph->NeighboursOf(other)) around.push_back(next);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    graph->normals_map[i] = FitNormal(*graph, around);
  }
}

}  // namespace dsg::ingest
