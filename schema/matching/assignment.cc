// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/assignment.h"

#include <algorithm>
#include <limits>

namespace dsg {
namespace {

/// Rows are added one by one, each by a shortest augmenting path in reduced costs. Indices count
/// from 1; column 0 stands for the row that is being added.
class Solver {
 public:
  explicit Solver(const Eigen::MatrixXd& cost)
      : cost_(cost),
        row_price_(static_cast<size_t>(cost.rows()) + 1, 0.0),
        column_price_(static_cast<size_t>(cost.cols()) + 1, 0.0),
        row_of_(static_cast<size_t>(cost.cols()) + 1, 0) {}

  std::vector<int> Solve() {
    for (size_t row = 1; row < row_price_.size(); ++row) AddRow(row);
    std::vector<int> column_of(row_price_.size() - 1, -1);
    for (size_t column = 1; column < row_of_.size(); ++column) {
      if (row_of_[column] > 0) column_of[row_of_[column] - 1] = static_cast<int>(column) - 1;
    }
    return column_of;
  }

 private:
  double Reduced(size_t row, size_t column) const {
    return cost_(static_cast<Eigen::Index>(row) - 1, static_cast<Eigen::Index>(column) - 1) -
           row_price_[row] - column_price_[column];
  }

  void AddRow(size_t row) {
    const size_t count = row_of_.size();
    std::vector<double> distance(count, std::numeric_limits<double>::infinity());
    std::vector<size_t> before(count, 0);
    std::vector<bool> is_done(count, false);
    row_of_[0] = row;
    size_t column = 0;
    do {
      is_done[column] = true;
      size_t next = 0;
      double step = std::numeric_limits<double>::infinity();
      for (size_t j = 1; j < count; ++j) {
        if (is_done[j]) continue;
        const double reduced = Reduced(row_of_[column], j);
        if (reduced < distance[j]) {
          distance[j] = reduced;
          before[j] = column;
        }
        if (distance[j] < step) {
          step = distance[j];
          next = j;
        }
      }
      for (size_t j = 0; j < count; ++j) {
        if (is_done[j]) {
          row_price_[row_of_[j]] += step;
          column_price_[j] -= step;
        } else {
          distance[j] -= step;
        }
      }
      column = next;
    } while (row_of_[column] != 0);
    for (; column != 0; column = before[column]) row_of_[column] = row_of_[before[column]];
  }

  const Eigen::MatrixXd& cost_;
  std::vector<double> row_price_;
  std::vector<double> column_price_;
  std::vector<size_t> row_of_;
};

}  // namespace

std::vector<int> MinimumAssignment(const Eigen::MatrixXd& cost) {
  if (cost.rows() == 0) return {};
  if (cost.rows() <= cost.cols()) return Solver(cost).Solve();
  const Eigen::MatrixXd transposed = cost.transpose();
  const std::vector<int> row_of =
      transposed.rows() == 0 ? std::vector<int>() : Solver(transposed).Solve();
  std::vector<int> column_of(static_cast<size_t>(cost.rows()), -1);
  for (size_t column = 0; column < row_of.size(); ++column) {
    column_of[static_cast<size_t>(row_of[column])] = static_cast<int>(column);
  }
  return column_of;
}

std::vector<int> GatedAssignment(const Eigen::MatrixXd& cost, double gate) {
  // One pair beyond the gate costs more than all within it together.
  const double beyond = (gate + 1.0) * static_cast<double>(std::min(cost.rows(), cost.cols()) + 1);
  std::vector<int> column_of =
      MinimumAssignment((cost.array() <= gate).select(cost, beyond).matrix());
  for (size_t row = 0; row < column_of.size(); ++row) {
    int& column = column_of[row];
    if (column >= 0 && !(cost(static_cast<Eigen::Index>(row), column) <= gate)) column = -1;
  }
  return column_of;
}

std::vector<int> MaximumAssignment(const Eigen::MatrixXd& weight) {
  std::vector<int> column_of = MinimumAssignment(-weight);
  for (size_t row = 0; row < column_of.size(); ++row) {
    int& column = column_of[row];
    if (column >= 0 && weight(static_cast<Eigen::Index>(row), column) <= 0.0) column = -1;
  }
  return column_of;
}

}  // namespace dsg
