// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/relative_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <vector>

#include "ingest/loop/optimize.h"
#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

// Rows of a twist that the graph moves in.
std::vector<int> RowsOf(bool is_planar) {
  return is_planar ? std::vector<int>{0, 1, 5} : std::vector<int>{0, 1, 2, 3, 4, 5};
}

Eigen::MatrixXd Shrunk(const Matrix6d& matrix, const std::vector<int>& rows) {
  return matrix(rows, rows);
}

Matrix6d Grown(const Eigen::MatrixXd& matrix, const std::vector<int>& rows) {
  Matrix6d grown = Matrix6d::Zero();
  grown(rows, rows) = matrix;
  return grown;
}

}  // namespace

struct RelativeCovariances::Network {
  std::vector<int> rows;
  Pose3d middle_T_map;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  Eigen::VectorXd pivots;
  // Of Resistance: zeros in between.
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> solved;
  std::vector<bool> is_reached;

  void Factorise(const Eigen::SparseMatrix<double>& matrix) {
    factor.compute(matrix);
    if (factor.info() != Eigen::Success) return;
    pivots = factor.vectorD();
    solved.setZero(matrix.rows(), 6);
    is_reached.assign(static_cast<size_t>(matrix.rows()), false);
  }

  // E' M^-1 E of the ends E of two poses. With M = L D L', that is Y' D^-1 Y with L Y = E, and Y
  // has no other rows than those that the elimination tree leads to from E: few of a large graph.
  Eigen::MatrixXd Resistance(int from, int to) {
    const int width = static_cast<int>(rows.size());
    const auto& lower = factor.matrixL().nestedExpression();
    const int* outer = lower.outerIndexPtr();
    const int* inner = lower.innerIndexPtr();
    const double* values = lower.valuePtr();
    const auto& place = factor.permutationP().indices();
    std::vector<int> reached;
    for (const int end : {from, to}) {
      for (int k = 0; k < width; ++k) {
        int row = place[end * width + k];
        solved(row, k) = end == to ? 1.0 : -1.0;
        while (!is_reached[Index(row)]) {
          is_reached[Index(row)] = true;
          reached.push_back(row);
          // The parent in the tree is the first row below; roots are their own.
          if (outer[row] < outer[row + 1]) row = inner[outer[row]];
        }
      }
    }
    std::sort(reached.begin(), reached.end());
    Matrix6d sum = Matrix6d::Zero();
    for (const int column : reached) {
      const Eigen::Matrix<double, 1, 6> row = solved.row(column);
      for (int at = outer[column]; at < outer[column + 1]; ++at) {
        solved.row(inner[at]) -= values[at] * row;
      }
      sum += row.transpose() * row / pivots[column];
      solved.row(column).setZero();
      is_reached[Index(column)] = false;
    }
    return sum.topLeftCorner(width, width);
  }

  void Add(int a, int b, const Eigen::MatrixXd& block,
           std::vector<Eigen::Triplet<double>>* triplets) const {
    const int width = static_cast<int>(rows.size());
    for (int i = 0; i < width; ++i) {
      for (int j = 0; j < width; ++j) {
        triplets->emplace_back(a * width + i, b * width + j, block(i, j));
      }
    }
  }
};

RelativeCovariances::RelativeCovariances(const PoseGraph& graph,
                                         const std::vector<Pose3d>& map_T_pose,
                                         const std::vector<bool>& is_believed)
    : graph_(graph), map_T_pose_(map_T_pose), is_believed_(is_believed) {}

RelativeCovariances::~RelativeCovariances() = default;

void RelativeCovariances::Factorise() {
  network_ = std::make_unique<Network>();
  Network& network = *network_;
  network.rows = RowsOf(graph_.is_planar);
  // Twists about the middle of the map: far from their axes, numbers lose digits.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose3d& pose : map_T_pose_) sum += pose.position;
  network.middle_T_map.position = -sum / std::max(1.0, static_cast<double>(map_T_pose_.size()));
  std::vector<double> weights;
  std::vector<Eigen::Triplet<double>> triplets;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    weights.push_back(is_believed_[e] ? 1.0 : 0.0);
    if (!is_believed_[e]) continue;
    const RelativePose& edge = graph_.edges[e];
    const Matrix6d adjoint = AdjointOf(network.middle_T_map * map_T_pose_[Index(edge.to)]);
    const Matrix6d covariance = MovedCovariance(adjoint, CovarianceOf(edge, graph_.is_planar));
    const Eigen::MatrixXd weight = Shrunk(InverseOf(covariance, graph_.is_planar), network.rows);
    network.Add(edge.from, edge.from, weight, &triplets);
    network.Add(edge.to, edge.to, weight, &triplets);
    network.Add(edge.from, edge.to, -weight, &triplets);
    network.Add(edge.to, edge.from, -weight, &triplets);
  }
  parts_ = PartsOf(graph_, weights);
  // One pose of each part is held; which one, and how firmly, cancels out.
  const int width = static_cast<int>(network.rows.size());
  int part_count = 0;
  for (size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i] != part_count) continue;
    ++part_count;
    network.Add(static_cast<int>(i), static_cast<int>(i), Eigen::MatrixXd::Identity(width, width),
                &triplets);
  }
  const int size = width * static_cast<int>(map_T_pose_.size());
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  network.Factorise(matrix);
}

std::optional<Matrix6d> RelativeCovariances::Between(int from, int to) {
  if (!network_) Factorise();
  if (parts_[Index(from)] != parts_[Index(to)]) return std::nullopt;
  if (network_->factor.info() != Eigen::Success) return std::nullopt;
  const Matrix6d grown = Grown(network_->Resistance(from, to), network_->rows);
  return MovedCovariance(AdjointOf(network_->middle_T_map.Inverse()), grown);
}

std::optional<Matrix6d> WithoutEdge(const Matrix6d& with, const Matrix6d& edge, bool is_planar) {
  const Matrix6d without =
      InverseOf(InverseOf(with, is_planar) - InverseOf(edge, is_planar), is_planar);
  if (without.isZero(0.0)) return std::nullopt;
  return without;
}

}  // namespace dsg::ingest
