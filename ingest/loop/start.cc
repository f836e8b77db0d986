// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/start.h"

#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <cstdint>

#include "ingest/loop/optimize.h"
#include "ingest/loop/residual.h"
#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

double EdgeWeight(const std::vector<double>& weights, size_t edge) {
  return weights.empty() ? 1.0 : weights[edge];
}

// Poses that are solved for, numbered; -1 = an anchor.
std::vector<int> NumberUnknowns(size_t pose_count, const std::vector<int>& anchors) {
  std::vector<int> unknowns(pose_count, 0);
  for (const int anchor : anchors) unknowns[static_cast<size_t>(anchor)] = -1;
  int count = 0;
  for (int& unknown : unknowns) {
    if (unknown == 0) unknown = count++;
  }
  return unknowns;
}

// Normal equations of sums of weight |x_to - m' x_from - offset|^2 in blocks of `size` rows, where
// the rows of anchors are known.
class LinearPoses {
 public:
  LinearPoses(const std::vector<int>& unknowns, int size, MatrixXd values)
      : unknowns_(unknowns), size_(size), values_(std::move(values)) {
    int count = 0;
    for (const int unknown : unknowns) count += unknown >= 0 ? 1 : 0;
    right_ = MatrixXd::Zero(count * size, values_.cols());
  }

  // Requires: `m` orthogonal, so that the diagonal is the weight alone.
  void Add(double weight, const RelativePose& edge, const MatrixXd& m, const MatrixXd& offset) {
    const int from = unknowns_[static_cast<size_t>(edge.from)];
    const int to = unknowns_[static_cast<size_t>(edge.to)];
    if (from >= 0) right_.middleRows(from * size_, size_) -= weight * m * offset;
    if (to >= 0) right_.middleRows(to * size_, size_) += weight * offset;
    for (int r = 0; r < size_; ++r) {
      if (from >= 0) entries_.emplace_back(from * size_ + r, from * size_ + r, weight);
      if (to >= 0) entries_.emplace_back(to * size_ + r, to * size_ + r, weight);
    }
    if (from >= 0 && to >= 0) {
      AddCross(-weight * m, from, to);
    } else if (from >= 0) {
      right_.middleRows(from * size_, size_) +=
          weight * m * values_.middleRows(edge.to * size_, size_);
    } else if (to >= 0) {
      right_.middleRows(to * size_, size_) +=
          weight * m.transpose() * values_.middleRows(edge.from * size_, size_);
    }
  }

  // All rows, those of anchors as given; NaN where the equations are singular.
  MatrixXd Solve() {
    SparseMatrix normal(right_.rows(), right_.rows());
    normal.setFromTriplets(entries_.begin(), entries_.end());
    MatrixXd solved = MatrixXd::Constant(right_.rows(), right_.cols(), std::nan(""));
    if (right_.rows() > 0) {
      const Eigen::SimplicialLDLT<SparseMatrix> solver(normal);
      if (solver.info() == Eigen::Success) solved = solver.solve(right_);
    }
    for (size_t i = 0; i < unknowns_.size(); ++i) {
      if (unknowns_[i] < 0) continue;
      values_.middleRows(static_cast<int>(i) * size_, size_) =
          solved.middleRows(unknowns_[i] * size_, size_);
    }
    return std::move(values_);
  }

 private:
  // Only the lower triangle is read.
  void AddCross(const MatrixXd& block, int from, int to) {
    for (int r = 0; r < size_; ++r) {
      for (int c = 0; c < size_; ++c) {
        const int row = from * size_ + r;
        const int column = to * size_ + c;
        entries_.emplace_back(std::max(row, column), std::min(row, column), block(r, c));
      }
    }
  }

  const std::vector<int>& unknowns_;
  const int size_;
  MatrixXd values_;
  MatrixXd right_;
  std::vector<Eigen::Triplet<double>> entries_;
};

// The rotation nearest to a matrix in the Frobenius norm.
Matrix3d NearestRotation(const MatrixXd& matrix) {
  Matrix3d rotation = Matrix3d::Identity();
  if (matrix.rows() == 2) {
    const double yaw = std::atan2(matrix(1, 0) - matrix(0, 1), matrix(0, 0) + matrix(1, 1));
    rotation.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(yaw).toRotationMatrix();
    return rotation;
  }
  const Eigen::JacobiSVD<Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d left = svd.matrixU();
  if ((left * svd.matrixV().transpose()).determinant() < 0.0) left.col(2) *= -1.0;
  return left * svd.matrixV().transpose();
}

// Poses of the graph with rotations found from the edges' rotations alone. The unknowns are
// transposed matrices, whose columns do not mix.
bool SolveRotations(const PoseGraph& graph, const std::vector<double>& weights,
                    const std::vector<int>& unknowns, std::vector<Matrix3d>* rotations) {
  const int size = graph.is_planar ? 2 : 3;
  MatrixXd values = MatrixXd::Zero(static_cast<int>(unknowns.size()) * size, size);
  for (size_t i = 0; i < unknowns.size(); ++i) {
    values.middleRows(static_cast<int>(i) * size, size) =
        (*rotations)[i].topLeftCorner(size, size).transpose();
  }
  LinearPoses equations(unknowns, size, std::move(values));
  const MatrixXd nothing = MatrixXd::Zero(size, size);
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const RelativePose& edge = graph.edges[i];
    const double weight = EdgeWeight(weights, i) * WeightsOf(edge, graph.is_planar).kappa;
    if (weight == 0.0) continue;
    const Matrix3d turn = edge.from_T_to.orientation.toRotationMatrix();
    equations.Add(weight, edge, turn.topLeftCorner(size, size), nothing);
  }
  const MatrixXd solved = equations.Solve();
  if (!solved.allFinite()) return false;
  for (size_t i = 0; i < unknowns.size(); ++i) {
    if (unknowns[i] < 0) continue;
    (*rotations)[i] =
        NearestRotation(solved.middleRows(static_cast<int>(i) * size, size).transpose());
  }
  return true;
}

bool SolveTranslations(const PoseGraph& graph, const std::vector<double>& weights,
                       const std::vector<int>& unknowns, const std::vector<Matrix3d>& rotations,
                       std::vector<Pose3d>* poses) {
  MatrixXd values(static_cast<int>(poses->size()), 3);
  for (size_t i = 0; i < poses->size(); ++i) {
    values.row(static_cast<int>(i)) = (*poses)[i].position.transpose();
  }
  LinearPoses equations(unknowns, 1, std::move(values));
  const MatrixXd one = MatrixXd::Identity(1, 1);
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const RelativePose& edge = graph.edges[i];
    const double weight = EdgeWeight(weights, i) * WeightsOf(edge, graph.is_planar).tau;
    if (weight == 0.0) continue;
    const Eigen::Vector3d way = rotations[static_cast<size_t>(edge.from)] * edge.from_T_to.position;
    equations.Add(weight, edge, one, way.transpose());
  }
  const MatrixXd solved = equations.Solve();
  if (!solved.allFinite()) return false;
  for (size_t i = 0; i < poses->size(); ++i) {
    if (unknowns[i] < 0) continue;
    (*poses)[i].position = solved.row(static_cast<int>(i)).transpose();
    if (graph.is_planar) (*poses)[i].position.z() = graph.poses[i].position.z();
    (*poses)[i].orientation = Eigen::Quaterniond(rotations[i]).normalized();
  }
  return true;
}

// Edges that join all poses of each part without a circle, by pose.
std::vector<std::vector<int>> TreeOf(const PoseGraph& graph, const std::vector<double>& weights) {
  std::vector<std::vector<int>> tree(graph.poses.size());
  DisjointSets sets(graph.poses.size());
  for (const bool is_loop : {false, true}) {
    for (size_t i = 0; i < graph.edges.size(); ++i) {
      const RelativePose& edge = graph.edges[i];
      if (edge.is_loop != is_loop || EdgeWeight(weights, i) == 0.0) continue;
      if (!sets.Merge(edge.from, edge.to)) continue;
      tree[static_cast<size_t>(edge.from)].push_back(static_cast<int>(i));
      tree[static_cast<size_t>(edge.to)].push_back(static_cast<int>(i));
    }
  }
  return tree;
}

}  // namespace

std::vector<Pose3d> TreeStart(const PoseGraph& graph, const std::vector<double>& weights,
                              const std::vector<int>& anchors) {
  const std::vector<std::vector<int>> tree = TreeOf(graph, weights);
  std::vector<Pose3d> poses = graph.poses;
  std::vector<bool> is_done(poses.size(), false);
  std::vector<int> open = anchors;
  for (const int anchor : anchors) is_done[static_cast<size_t>(anchor)] = true;
  while (!open.empty()) {
    const auto at = static_cast<size_t>(open.back());
    open.pop_back();
    for (const int index : tree[at]) {
      const RelativePose& edge = graph.edges[static_cast<size_t>(index)];
      const bool is_forward = static_cast<size_t>(edge.from) == at;
      const auto next = static_cast<size_t>(is_forward ? edge.to : edge.from);
      if (is_done[next]) continue;
      is_done[next] = true;
      poses[next] = poses[at] * (is_forward ? edge.from_T_to : edge.from_T_to.Inverse());
      // A long way of products must not leave the unit sphere.
      poses[next].orientation.normalize();
      open.push_back(static_cast<int>(next));
    }
  }
  return poses;
}

std::vector<Pose3d> ChordalStartFrom(const PoseGraph& graph, const std::vector<double>& weights,
                                     const std::vector<int>& anchors) {
  std::vector<Pose3d> poses = graph.poses;
  std::vector<Matrix3d> rotations;
  rotations.reserve(poses.size());
  for (const Pose3d& pose : poses) rotations.push_back(pose.orientation.toRotationMatrix());
  const std::vector<int> unknowns = NumberUnknowns(poses.size(), anchors);
  if (anchors.size() == poses.size()) return poses;
  const bool is_solved = SolveRotations(graph, weights, unknowns, &rotations) &&
                         SolveTranslations(graph, weights, unknowns, rotations, &poses);
  return is_solved ? poses : TreeStart(graph, weights, anchors);
}

std::vector<Pose3d> ChordalStart(const PoseGraph& graph, const std::vector<double>& weights) {
  if (graph.poses.empty()) return {};
  return ChordalStartFrom(graph, weights, AnchorsOf(PartsOf(graph, weights), 0));
}

}  // namespace dsg::ingest
