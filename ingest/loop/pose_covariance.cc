// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pose_covariance.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/loop/residual.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::MatrixXd;
using SparseMatrix = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower>;

// The part of the inverse of L D L' that has the pattern of L: diagonal, and values below it.
struct SelectedInverse {
  const SparseMatrix& factor;
  Eigen::VectorXd diagonal;
  std::vector<double> below;

  double At(int row, int column) const {
    if (row == column) return diagonal[row];
    if (row < column) std::swap(row, column);
    const int* begin = factor.innerIndexPtr() + factor.outerIndexPtr()[column];
    const int* end = factor.innerIndexPtr() + factor.outerIndexPtr()[column + 1];
    const int* found = std::lower_bound(begin, end, row);
    return found != end && *found == row
               ? below[static_cast<size_t>(found - factor.innerIndexPtr())]
               : 0.0;
  }
};

SelectedInverse InvertSelected(const SparseMatrix& factor, const Eigen::VectorXd& pivots) {
  const int count = static_cast<int>(factor.cols());
  const int* outer = factor.outerIndexPtr();
  const int* rows = factor.innerIndexPtr();
  const double* values = factor.valuePtr();
  SelectedInverse inverse{factor, Eigen::VectorXd::Zero(count),
                          std::vector<double>(static_cast<size_t>(factor.nonZeros()), 0.0)};
  // Where a row stands in the column that is being worked out; -1 = not in it.
  std::vector<int> place(static_cast<size_t>(count), -1);
  for (int column = count - 1; column >= 0; --column) {
    const int begin = outer[column];
    const int end = outer[column + 1];
    for (int at = begin; at < end; ++at) place[static_cast<size_t>(rows[at])] = at;
    for (int at = begin; at < end; ++at) {
      const int k = rows[at];
      inverse.below[static_cast<size_t>(at)] -= values[at] * inverse.diagonal[k];
      for (int other = outer[k]; other < outer[k + 1]; ++other) {
        const int mirrored = place[static_cast<size_t>(rows[other])];
        if (mirrored < 0) continue;
        const double entry = inverse.below[static_cast<size_t>(other)];
        inverse.below[static_cast<size_t>(mirrored)] -= values[at] * entry;
        inverse.below[static_cast<size_t>(at)] -= values[mirrored] * entry;
      }
    }
    double sum = 1.0 / pivots[column];
    for (int at = begin; at < end; ++at) {
      sum -= values[at] * inverse.below[static_cast<size_t>(at)];
      place[static_cast<size_t>(rows[at])] = -1;
    }
    inverse.diagonal[column] = sum;
  }
  return inverse;
}

class NormalBuilder {
 public:
  NormalBuilder(const std::vector<int>& unknowns, int size) : unknowns_(unknowns), size_(size) {}

  void Add(const RelativePose& edge, const MatrixXd& information, const MatrixXd& by_from,
           const MatrixXd& by_to) {
    const int from = unknowns_[static_cast<size_t>(edge.from)];
    const int to = unknowns_[static_cast<size_t>(edge.to)];
    if (from >= 0) AddBlock(by_from.transpose() * information * by_from, from, from);
    if (to >= 0) AddBlock(by_to.transpose() * information * by_to, to, to);
    if (from >= 0 && to >= 0) AddBlock(by_to.transpose() * information * by_from, to, from);
  }

  SparseMatrix Build(int unknown_count) const {
    SparseMatrix normal(unknown_count * size_, unknown_count * size_);
    normal.setFromTriplets(entries_.begin(), entries_.end());
    return normal;
  }

 private:
  void AddBlock(const MatrixXd& block, int row, int column) {
    for (int r = 0; r < size_; ++r) {
      for (int c = 0; c < size_; ++c) {
        const int i = row * size_ + r;
        const int j = column * size_ + c;
        if (row == column && i < j) continue;
        entries_.emplace_back(std::max(i, j), std::min(i, j), block(r, c));
      }
    }
  }

  const std::vector<int>& unknowns_;
  const int size_;
  std::vector<Eigen::Triplet<double>> entries_;
};

SparseMatrix NormalOf(const PoseGraph& graph, const std::vector<Pose3d>& poses,
                      const std::vector<int>& unknowns, int unknown_count,
                      const OptimizeOptions& options) {
  const RotationError error = RotationErrorOf(options.objective, graph.is_planar);
  NormalBuilder builder(unknowns, graph.is_planar ? 3 : 6);
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const RelativePose& edge = graph.edges[i];
    const double weight = options.weights.empty() ? 1.0 : options.weights[i];
    if (weight == 0.0) continue;
    const Pose3d& from = poses[static_cast<size_t>(edge.from)];
    const Pose3d& to = poses[static_cast<size_t>(edge.to)];
    const Matrix6d information = weight * InformationOf(edge, graph.is_planar, options.objective);
    if (graph.is_planar) {
      Eigen::Matrix3d by_from;
      Eigen::Matrix3d by_to;
      PlanarResidual(PlanarOf(edge.from_T_to), PlanarOf(from), PlanarOf(to), error, &by_from,
                     &by_to);
      builder.Add(edge, PlanarBlock(information), by_from, by_to);
    } else {
      Matrix6d by_from;
      Matrix6d by_to;
      SpatialResidual(edge.from_T_to, from, to, error, &by_from, &by_to);
      builder.Add(edge, information, by_from, by_to);
    }
  }
  return builder.Build(unknown_count);
}

Matrix6d SpreadPlanar(const MatrixXd& block) {
  constexpr int kRows[] = {0, 1, 5};
  Matrix6d spread = Matrix6d::Zero();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) spread(kRows[r], kRows[c]) = block(r, c);
  }
  return spread;
}

}  // namespace

std::vector<MatrixXd> DiagonalOfInverse(const SparseMatrix& normal, int size) {
  const Solver solver(normal);
  if (solver.info() != Eigen::Success || !(solver.vectorD().array() > 0.0).all()) return {};
  const SparseMatrix factor = solver.matrixL().nestedExpression();
  const SelectedInverse inverse = InvertSelected(factor, solver.vectorD());
  const auto& order = solver.permutationP().indices();
  std::vector<MatrixXd> blocks;
  blocks.reserve(static_cast<size_t>(normal.cols() / size));
  for (int first = 0; first < normal.cols(); first += size) {
    MatrixXd block(size, size);
    for (int r = 0; r < size; ++r) {
      for (int c = 0; c < size; ++c) block(r, c) = inverse.At(order[first + r], order[first + c]);
    }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

absl::StatusOr<std::vector<Matrix6d>> CovariancesOf(const PoseGraph& graph,
                                                    const std::vector<Pose3d>& poses,
                                                    const std::vector<int>& anchors,
                                                    const OptimizeOptions& options) {
  if (poses.size() > kCovariancePosesMax) {
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat("covariances of ", poses.size(), " poses; at most ",
                                  kCovariancePosesMax, ", take fewer keyframes"));
  }
  std::vector<int> unknowns(poses.size(), 0);
  for (const int anchor : anchors) unknowns[static_cast<size_t>(anchor)] = -1;
  int count = 0;
  for (int& unknown : unknowns) unknown = unknown < 0 ? -1 : count++;
  std::vector<Matrix6d> covariances(poses.size(), Matrix6d::Zero());
  if (count == 0) return covariances;
  const std::vector<MatrixXd> blocks =
      DiagonalOfInverse(NormalOf(graph, poses, unknowns, count, options), graph.is_planar ? 3 : 6);
  if (blocks.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     "the information matrices differ too much in size for covariances of the "
                     "poses; check their units");
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    if (unknowns[i] < 0) continue;
    const MatrixXd& block = blocks[static_cast<size_t>(unknowns[i])];
    covariances[i] = graph.is_planar ? SpreadPlanar(block) : Matrix6d(block);
  }
  return covariances;
}

}  // namespace dsg::ingest
