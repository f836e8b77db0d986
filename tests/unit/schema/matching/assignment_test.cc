// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

double CostOf(const Eigen::MatrixXd& cost, const std::vector<int>& column_of) {
  double sum = 0.0;
  for (size_t row = 0; row < column_of.size(); ++row) {
    if (column_of[row] >= 0) sum += cost(static_cast<Eigen::Index>(row), column_of[row]);
  }
  return sum;
}

// All ways of giving each row a column of its own. Requires: rows <= columns.
double LeastCost(const Eigen::MatrixXd& cost) {
  std::vector<int> columns(static_cast<size_t>(cost.cols()));
  std::iota(columns.begin(), columns.end(), 0);
  double best = std::numeric_limits<double>::infinity();
  do {
    const std::vector<int> chosen(columns.begin(), columns.begin() + cost.rows());
    best = std::min(best, CostOf(cost, chosen));
  } while (std::next_permutation(columns.begin(), columns.end()));
  return best;
}

Eigen::MatrixXd RandomMatrix(Eigen::Index rows, Eigen::Index columns, std::mt19937_64* random) {
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    matrix.data()[i] = static_cast<double>((*random)() % 100) / 4.0;
  }
  return matrix;
}

TEST(Assignment, CostsAsLittleAsTheBestOfAllPermutations) {
  std::mt19937_64 random(test::TestSeed(1));
  for (int round = 0; round < 200; ++round) {
    const auto rows = static_cast<Eigen::Index>(1 + random() % 5);
    const Eigen::Index columns = rows + static_cast<Eigen::Index>(random() % 2);
    const Eigen::MatrixXd cost = RandomMatrix(rows, columns, &random);
    EXPECT_DOUBLE_EQ(CostOf(cost, MinimumAssignment(cost)), LeastCost(cost));
    const Eigen::MatrixXd turned = cost.transpose();
    EXPECT_DOUBLE_EQ(CostOf(turned, MinimumAssignment(turned)), LeastCost(cost));
  }
}

TEST(Assignment, GivesEachColumnOnce) {
  std::mt19937_64 random(test::TestSeed(2));
  const Eigen::MatrixXd cost = RandomMatrix(30, 20, &random);
  std::vector<int> columns = MinimumAssignment(cost);
  std::sort(columns.begin(), columns.end());
  EXPECT_EQ(std::count(columns.begin(), columns.end(), -1), 10);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(columns[static_cast<size_t>(10 + i)], i);
}

TEST(Assignment, PrefersMorePairsWithinTheGateToFewerCheapOnes) {
  Eigen::MatrixXd cost(2, 2);
  cost << 0.0, 0.9, 0.9, 5.0;
  EXPECT_EQ(GatedAssignment(cost, 1.0), (std::vector<int>{1, 0}));
  EXPECT_EQ(GatedAssignment(cost, 0.5), (std::vector<int>{0, -1}));
}

TEST(Assignment, LeavesPairsOfNoWeightApart) {
  Eigen::MatrixXd weight(2, 2);
  weight << 3.0, 4.0, 0.0, 2.0;
  EXPECT_EQ(MaximumAssignment(weight), (std::vector<int>{0, 1}));
  weight << 3.0, 0.0, 1.0, 0.0;
  EXPECT_EQ(MaximumAssignment(weight), (std::vector<int>{0, -1}));
}

TEST(Assignment, TakesEmptySides) {
  EXPECT_TRUE(MinimumAssignment(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(MinimumAssignment(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
  EXPECT_EQ(GatedAssignment(Eigen::MatrixXd(1, 0), 1.0), std::vector<int>{-1});
}

}  // namespace
}  // namespace dsg
