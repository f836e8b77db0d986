// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/marginalization.h"

#include <ceres/cost_function.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "ingest/solver/pose_block.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A direction of a dropped block that its factors tell less of than this share of what they tell of
// the others is taken as not observed.
constexpr double kObservedShareMin = 1e-10;

// The blocks of all factors, numbered in the order in which they appear.
struct BlockTable {
  std::vector<double*> blocks;
  std::vector<int> sizes;
  std::vector<bool> is_held;
  absl::flat_hash_map<const double*, int> index;

  int StepSize(int block) const { return StepSizeOf(sizes[static_cast<size_t>(block)]); }
};

// Linear equations: jacobian * (steps of the blocks, one after the other) + residual.
struct Equations {
  /// Ascending, each once.
  std::vector<int> blocks;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;

  bool Has(int block) const { return std::binary_search(blocks.begin(), blocks.end(), block); }
};

absl::Status BadFactor(size_t index, size_t count, const std::string& what) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("factor ", index + 1, " of ", count, " to be marginalised ", what),
                   {{"field", absl::StrCat("factors[", index, "]")}});
}

absl::StatusOr<BlockTable> Number(std::span<const WindowFactor> factors,
                                  std::span<double* const> held) {
  BlockTable table;
  for (size_t i = 0; i < factors.size(); ++i) {
    const std::vector<int32_t>& sizes = factors[i].cost->parameter_block_sizes();
    if (sizes.size() != factors[i].blocks.size()) {
      return BadFactor(i, factors.size(),
                       absl::StrCat("has ", factors[i].blocks.size(),
                                    " blocks; its cost function takes ", sizes.size()));
    }
    for (size_t k = 0; k < sizes.size(); ++k) {
      double* const block = factors[i].blocks[k];
      const auto [entry, is_new] =
          table.index.try_emplace(block, static_cast<int>(table.blocks.size()));
      if (is_new) {
        table.blocks.push_back(block);
        table.sizes.push_back(sizes[k]);
        table.is_held.push_back(std::find(held.begin(), held.end(), block) != held.end());
      } else if (table.sizes[static_cast<size_t>(entry->second)] != sizes[k]) {
        return BadFactor(i, factors.size(),
                         absl::StrCat("takes ", sizes[k], " numbers of its block ", k,
                                      ", of which another factor takes ",
                                      table.sizes[static_cast<size_t>(entry->second)]));
      }
    }
  }
  return table;
}

// Zeros for the steps of `blocks`.
Equations Empty(const BlockTable& table, std::vector<int> blocks, Eigen::Index row_count) {
  Eigen::Index column_count = 0;
  for (const int block : blocks) column_count += table.StepSize(block);
  return {std::move(blocks), Eigen::MatrixXd::Zero(row_count, column_count),
          Eigen::VectorXd::Zero(row_count)};
}

// The first column of `block`. Requires: it is there.
Eigen::Index ColumnOf(const BlockTable& table, const std::vector<int>& blocks, int block) {
  Eigen::Index column = 0;
  for (const int other : blocks) {
    if (other == block) break;
    column += table.StepSize(other);
  }
  return column;
}

absl::StatusOr<Equations> Linearize(std::span<const WindowFactor> factors, size_t index,
                                    const BlockTable& table) {
  const WindowFactor& factor = factors[index];
  std::vector<int> blocks;
  for (const double* block : factor.blocks) {
    const int number = table.index.at(block);
    if (!table.is_held[static_cast<size_t>(number)]) blocks.push_back(number);
  }
  std::sort(blocks.begin(), blocks.end());
  if (std::adjacent_find(blocks.begin(), blocks.end()) != blocks.end()) {
    return BadFactor(index, factors.size(), "takes one block twice");
  }
  const std::optional<LinearFactor> linear = Linearized(factor);
  if (!linear.has_value()) {
    return BadFactor(index, factors.size(),
                     "is not finite where the window is; drop the window and begin anew");
  }
  Equations equations = Empty(table, std::move(blocks), linear->residual.size());
  equations.residual = linear->residual;
  for (size_t k = 0; k < linear->by_block.size(); ++k) {
    const int number = table.index.at(factor.blocks[k]);
    if (table.is_held[static_cast<size_t>(number)]) continue;
    equations.jacobian.middleCols(ColumnOf(table, equations.blocks, number),
                                  table.StepSize(number)) = linear->by_block[k];
  }
  return equations;
}

// All equations below one another.
Equations Stack(const BlockTable& table, const std::vector<Equations>& parts) {
  std::vector<int> blocks;
  Eigen::Index row_count = 0;
  for (const Equations& part : parts) {
    blocks.insert(blocks.end(), part.blocks.begin(), part.blocks.end());
    row_count += part.residual.size();
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  Equations all = Empty(table, std::move(blocks), row_count);
  Eigen::Index row = 0;
  for (const Equations& part : parts) {
    const Eigen::Index rows = part.residual.size();
    Eigen::Index column = 0;
    for (const int block : part.blocks) {
      const Eigen::Index size = table.StepSize(block);
      all.jacobian.block(row, ColumnOf(table, all.blocks, block), rows, size) =
          part.jacobian.middleCols(column, size);
      column += size;
    }
    all.residual.segment(row, rows) = part.residual;
    row += rows;
  }
  return all;
}

// Equations of the same least squares in no more rows than columns. What no step changes is lost.
void Compress(Equations* equations) {
  const Eigen::Index columns = equations->jacobian.cols();
  if (equations->jacobian.rows() <= columns) return;
  Eigen::MatrixXd whole(equations->jacobian.rows(), columns + 1);
  whole << equations->jacobian, equations->residual;
  // In place.
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(whole);
  equations->jacobian = whole.topLeftCorner(columns, columns).triangularView<Eigen::Upper>();
  equations->residual = whole.col(columns).head(columns);
}

// What `equations` tell of the other blocks whatever the step of `block`.
Equations Without(const BlockTable& table, Equations equations, int block) {
  const Eigen::Index size = table.StepSize(block);
  const Eigen::Index first = ColumnOf(table, equations.blocks, block);
  const Eigen::Index rest = equations.jacobian.cols() - first - size;
  // Of one length, so that metres and radians count alike in the rank.
  Eigen::MatrixXd own = equations.jacobian.middleCols(first, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double norm = own.col(i).norm();
    if (norm > 0.0) own.col(i) /= norm;
  }
  Eigen::MatrixXd others(equations.jacobian.rows(), first + rest + 1);
  others << equations.jacobian.leftCols(first), equations.jacobian.rightCols(rest),
      equations.residual;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(own);
  qr.setThreshold(kObservedShareMin);
  const Eigen::Index rank = qr.rank();
  others.applyOnTheLeft(qr.householderQ().adjoint());
  std::erase(equations.blocks, block);
  const Eigen::Index row_count = others.rows() - rank;
  equations.jacobian = others.bottomLeftCorner(row_count, first + rest);
  equations.residual = others.bottomRightCorner(row_count, 1);
  Compress(&equations);
  return equations;
}

// Replaces the equations that touch `block` by what they tell of the others.
void Eliminate(const BlockTable& table, int block, std::vector<Equations>* system) {
  const auto touching = std::stable_partition(
      system->begin(), system->end(), [block](const Equations& part) { return !part.Has(block); });
  if (touching == system->end()) return;
  std::vector<Equations> parts(std::make_move_iterator(touching),
                               std::make_move_iterator(system->end()));
  system->erase(touching, system->end());
  Equations left = Without(table, Stack(table, parts), block);
  if (left.residual.size() > 0) system->push_back(std::move(left));
}

LinearPrior PriorOf(const BlockTable& table, Equations equations) {
  LinearPrior prior;
  for (const int block : equations.blocks) {
    double* const values = table.blocks[static_cast<size_t>(block)];
    const int size = table.sizes[static_cast<size_t>(block)];
    prior.blocks.push_back(values);
    prior.sizes.push_back(size);
    prior.point.insert(prior.point.end(), values, values + size);
  }
  prior.jacobian = std::move(equations.jacobian);
  prior.residual = std::move(equations.residual);
  return prior;
}

class PriorFactor : public ceres::CostFunction {
 public:
  explicit PriorFactor(LinearPrior prior) : prior_(std::move(prior)) {
    set_num_residuals(static_cast<int>(prior_.residual.size()));
    for (const int size : prior_.sizes) mutable_parameter_block_sizes()->push_back(size);
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    Eigen::VectorXd step(prior_.jacobian.cols());
    Eigen::Index column = 0;
    const double* point = prior_.point.data();
    for (size_t i = 0; i < prior_.sizes.size(); ++i) {
      const int size = prior_.sizes[i];
      const int step_size = StepSizeOf(size);
      if (size == kPoseBlockSize) {
        step.segment<kPoseStepSize>(column) =
            StepBetween(PoseOfBlock(point), PoseOfBlock(blocks[i]));
      } else {
        step.segment(column, size) = Eigen::Map<const Eigen::VectorXd>(blocks[i], size) -
                                     Eigen::Map<const Eigen::VectorXd>(point, size);
      }
      if (jacobians != nullptr && jacobians[i] != nullptr) {
        Eigen::Map<RowMatrix> jacobian(jacobians[i], prior_.jacobian.rows(), size);
        jacobian.leftCols(step_size) = prior_.jacobian.middleCols(column, step_size);
        jacobian.rightCols(size - step_size).setZero();
      }
      column += step_size;
      point += size;
    }
    Eigen::Map<Eigen::VectorXd>(residuals, prior_.residual.size()) =
        prior_.residual + prior_.jacobian * step;
    return true;
  }

 private:
  const LinearPrior prior_;
};

}  // namespace

absl::StatusOr<LinearPrior> Marginalize(std::span<const WindowFactor> factors,
                                        std::span<double* const> dropped,
                                        std::span<double* const> held) {
  DSG_ASSIGN_OR_RETURN(const BlockTable table, Number(factors, held));
  std::vector<Equations> system;
  for (size_t i = 0; i < factors.size(); ++i) {
    DSG_ASSIGN_OR_RETURN(Equations equations, Linearize(factors, i, table));
    system.push_back(std::move(equations));
  }
  for (const double* block : dropped) {
    const auto entry = table.index.find(block);
    if (entry != table.index.end()) Eliminate(table, entry->second, &system);
  }
  Equations left = Stack(table, system);
  Compress(&left);
  return PriorOf(table, std::move(left));
}

std::unique_ptr<ceres::CostFunction> MakePriorFactor(LinearPrior prior) {
  return std::make_unique<PriorFactor>(std::move(prior));
}

}  // namespace dsg::ingest
