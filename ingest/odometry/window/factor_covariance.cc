// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/factor_covariance.h"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Numbers of the blocks that are eliminated first.
constexpr int kLandmarkSize = 3;

// Where the steps of the blocks stand among the columns. Landmarks have none.
struct Columns {
  absl::flat_hash_map<const double*, Eigen::Index> first;
  Eigen::Index count = 0;

  void Add(const double* block, int block_size) {
    if (block_size == kLandmarkSize || !first.try_emplace(block, count).second) return;
    count += block_size == kPoseBlockSize ? kPoseStepSize : block_size;
  }
};

// What a landmark has to do with the other blocks.
struct LandmarkTerms {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  // By first column.
  std::map<Eigen::Index, Eigen::MatrixXd> with;
};

struct Normal {
  Eigen::MatrixXd matrix;
  // In the order in which factors name them.
  std::vector<LandmarkTerms> landmarks;
  absl::flat_hash_map<const double*, size_t> landmark_of;
};

struct Linear {
  struct Part {
    const double* block;
    bool is_landmark;
    Eigen::MatrixXd jacobian;
  };
  std::vector<Part> parts;
};

absl::Status Undetermined() {
  return MakeError(Reason::kFieldInvalid,
                   "the window's covariance is not finite: its factors do not determine its "
                   "states; begin anew",
                   {{"field", "factors"}});
}

absl::StatusOr<Linear> LinearOf(const WindowFactor& factor) {
  const int rows = factor.cost->num_residuals();
  const auto& sizes = factor.cost->parameter_block_sizes();
  Eigen::VectorXd residual(rows);
  std::vector<RowMatrix> jacobians;
  std::vector<double*> outputs;
  for (const int size : sizes) jacobians.emplace_back(RowMatrix::Zero(rows, size));
  for (RowMatrix& jacobian : jacobians) outputs.push_back(jacobian.data());
  if (!factor.cost->Evaluate(factor.blocks.data(), residual.data(), outputs.data()) ||
      !residual.allFinite()) {
    return Undetermined();
  }
  double weight = 1.0;
  if (factor.loss != nullptr) {
    double rho[3];
    factor.loss->Evaluate(residual.squaredNorm(), rho);
    weight = std::sqrt(std::max(0.0, rho[1]));
  }
  Linear linear;
  for (size_t k = 0; k < sizes.size(); ++k) {
    const int step = sizes[k] == kPoseBlockSize ? kPoseStepSize : sizes[k];
    linear.parts.push_back(
        {factor.blocks[k], sizes[k] == kLandmarkSize, weight * jacobians[k].leftCols(step)});
  }
  return linear;
}

void AddTo(const Linear& linear, const Columns& columns, Normal* normal) {
  for (const Linear::Part& a : linear.parts) {
    if (a.is_landmark) {
      const auto [entry, is_new] =
          normal->landmark_of.try_emplace(a.block, normal->landmarks.size());
      if (is_new) normal->landmarks.emplace_back();
      LandmarkTerms& landmark = normal->landmarks[entry->second];
      landmark.square += a.jacobian.transpose() * a.jacobian;
      for (const Linear::Part& b : linear.parts) {
        if (b.is_landmark) continue;
        const Eigen::MatrixXd product = b.jacobian.transpose() * a.jacobian;
        const auto [with, is_first] = landmark.with.try_emplace(columns.first.at(b.block), product);
        if (!is_first) with->second += product;
      }
      continue;
    }
    const Eigen::Index row = columns.first.at(a.block);
    for (const Linear::Part& b : linear.parts) {
      if (b.is_landmark) continue;
      normal->matrix.block(row, columns.first.at(b.block), a.jacobian.cols(), b.jacobian.cols()) +=
          a.jacobian.transpose() * b.jacobian;
    }
  }
}

void EliminateLandmark(const LandmarkTerms& landmark, Eigen::MatrixXd* matrix) {
  const Eigen::LDLT<Eigen::Matrix3d> root(landmark.square);
  for (const auto& [column, b] : landmark.with) {
    const Eigen::MatrixXd solved = root.solve(b.transpose());
    for (const auto& [row, a] : landmark.with) {
      matrix->block(row, column, a.rows(), b.rows()) -= a * solved;
    }
  }
}

}  // namespace

absl::StatusOr<Eigen::MatrixXd> CovarianceOf(std::span<const WindowFactor> factors,
                                             std::span<double* const> wanted) {
  Columns columns;
  for (const WindowFactor& factor : factors) {
    for (size_t k = 0; k < factor.blocks.size(); ++k) {
      columns.Add(factor.blocks[k], factor.cost->parameter_block_sizes()[k]);
    }
  }
  Normal normal;
  normal.matrix = Eigen::MatrixXd::Zero(columns.count, columns.count);
  std::map<Eigen::Index, Eigen::Index> sizes_at;
  for (const WindowFactor& factor : factors) {
    DSG_ASSIGN_OR_RETURN(const Linear linear, LinearOf(factor));
    AddTo(linear, columns, &normal);
    for (const Linear::Part& part : linear.parts) {
      if (!part.is_landmark) sizes_at[columns.first.at(part.block)] = part.jacobian.cols();
    }
  }
  for (const LandmarkTerms& terms : normal.landmarks) EliminateLandmark(terms, &normal.matrix);
  // Metres, radians and biases differ by many orders: one length for all columns.
  const Eigen::VectorXd diagonal = normal.matrix.diagonal();
  if (!diagonal.allFinite() || !(diagonal.array() > 0.0).all()) return Undetermined();
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> root(scale.asDiagonal() * normal.matrix * scale.asDiagonal());
  std::vector<Eigen::Index> picked;
  for (const double* block : wanted) {
    const auto entry = columns.first.find(block);
    if (entry == columns.first.end()) return Undetermined();
    for (Eigen::Index i = 0; i < sizes_at.at(entry->second); ++i) {
      picked.push_back(entry->second + i);
    }
  }
  Eigen::MatrixXd unit =
      Eigen::MatrixXd::Zero(columns.count, static_cast<Eigen::Index>(picked.size()));
  for (size_t i = 0; i < picked.size(); ++i) {
    unit(picked[i], static_cast<Eigen::Index>(i)) = scale[picked[i]];
  }
  const Eigen::MatrixXd solved = scale.asDiagonal() * root.solve(unit);
  Eigen::MatrixXd covariance(unit.cols(), unit.cols());
  for (size_t i = 0; i < picked.size(); ++i) {
    covariance.row(static_cast<Eigen::Index>(i)) = solved.row(picked[i]);
  }
  if (!covariance.allFinite() || !(covariance.diagonal().array() > 0.0).all()) {
    return Undetermined();
  }
  return Eigen::MatrixXd(0.5 * (covariance + covariance.transpose()));
}

}  // namespace dsg::ingest
