// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/factor_covariance.h"

#include <ceres/cost_function.h>

#include <Eigen/Cholesky>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Where the steps of the blocks stand among the columns. Landmarks have none.
struct Columns {
  absl::flat_hash_map<const double*, Eigen::Index> first;
  Eigen::Index count = 0;

  void Add(const double* block, int block_size) {
    if (first.try_emplace(block, count).second) count += StepSizeOf(block_size);
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
  std::vector<LandmarkTerms> landmarks;
  absl::flat_hash_map<const double*, size_t> landmark_of;
};

absl::Status Undetermined() {
  return MakeError(Reason::kFieldInvalid,
                   "the window's covariance is not finite: its factors do not determine its "
                   "states; begin anew",
                   {{"field", "factors"}});
}

void AddTo(const WindowFactor& factor, const LinearFactor& linear, const Columns& columns,
           Normal* normal) {
  const auto is_landmark = [&](size_t k) { return normal->landmark_of.contains(factor.blocks[k]); };
  for (size_t a = 0; a < factor.blocks.size(); ++a) {
    const Eigen::MatrixXd& by_a = linear.by_block[a];
    if (is_landmark(a)) {
      LandmarkTerms& landmark = normal->landmarks[normal->landmark_of.at(factor.blocks[a])];
      landmark.square += by_a.transpose() * by_a;
      for (size_t b = 0; b < factor.blocks.size(); ++b) {
        if (is_landmark(b)) continue;
        const Eigen::MatrixXd product = linear.by_block[b].transpose() * by_a;
        const auto [with, is_first] =
            landmark.with.try_emplace(columns.first.at(factor.blocks[b]), product);
        if (!is_first) with->second += product;
      }
      continue;
    }
    const Eigen::Index row = columns.first.at(factor.blocks[a]);
    for (size_t b = 0; b < factor.blocks.size(); ++b) {
      if (is_landmark(b)) continue;
      const Eigen::MatrixXd& by_b = linear.by_block[b];
      normal->matrix.block(row, columns.first.at(factor.blocks[b]), by_a.cols(), by_b.cols()) +=
          by_a.transpose() * by_b;
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
                                             std::span<double* const> landmarks,
                                             std::span<double* const> wanted) {
  Normal normal;
  normal.landmarks.resize(landmarks.size());
  for (size_t i = 0; i < landmarks.size(); ++i) normal.landmark_of.emplace(landmarks[i], i);
  Columns columns;
  for (const WindowFactor& factor : factors) {
    for (size_t k = 0; k < factor.blocks.size(); ++k) {
      if (normal.landmark_of.contains(factor.blocks[k])) continue;
      columns.Add(factor.blocks[k], factor.cost->parameter_block_sizes()[k]);
    }
  }
  normal.matrix = Eigen::MatrixXd::Zero(columns.count, columns.count);
  std::map<Eigen::Index, Eigen::Index> sizes_at;
  for (const WindowFactor& factor : factors) {
    const std::optional<LinearFactor> linear = Linearized(factor);
    if (!linear.has_value()) return Undetermined();
    AddTo(factor, *linear, columns, &normal);
    for (size_t k = 0; k < factor.blocks.size(); ++k) {
      const auto column = columns.first.find(factor.blocks[k]);
      if (column != columns.first.end()) sizes_at[column->second] = linear->by_block[k].cols();
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
