// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/state_chain.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"
#include "ingest/agents/estimation/chain_solver.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr int kCount = 12;

template <int N>
Eigen::Matrix<double, N, N> RandomCovariance(Random* random) {
  Eigen::Matrix<double, N, N> root;
  for (int i = 0; i < root.size(); ++i) root.data()[i] = random->Normal();
  return root * root.transpose() + 0.1 * Eigen::Matrix<double, N, N>::Identity();
}

template <int N>
ChainTerm<N> RandomTerm(Random* random, double loss_scale) {
  ChainTerm<N> term;
  for (int i = 0; i < term.jacobian.size(); ++i) term.jacobian.data()[i] = random->Normal();
  for (int i = 0; i < 3; ++i) term.target(i) = 3.0 * random->Normal();
  term.loss_scale = loss_scale;
  return term;
}

template <int N>
ChainLink<N> RandomLink(Random* random) {
  ChainLink<N> link;
  for (int i = 0; i < link.transition.size(); ++i) {
    link.transition.data()[i] += 0.2 * random->Normal();
  }
  link.covariance = RandomCovariance<N>(random);
  return link;
}

/// All states at once, by a dense matrix and squares only.
template <int N>
struct Dense {
  explicit Dense(const StateChain<N>& chain) {
    const int size = static_cast<int>(chain.size()) * N;
    information = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd vector = Eigen::VectorXd::Zero(size);
    information.topLeftCorner(N, N) += chain.initial_information();
    for (size_t i = 0; i < chain.size(); ++i) {
      const int at = static_cast<int>(i) * N;
      if (i > 0) {
        Eigen::MatrixXd both(N, 2 * N);
        both << -chain.link(i).transition, Eigen::MatrixXd::Identity(N, N);
        information.block(at - N, at - N, 2 * N, 2 * N) +=
            both.transpose() * chain.link(i).covariance.inverse() * both;
      }
      for (const ChainTerm<N>& term : chain.terms(i)) {
        information.block(at, at, N, N) += term.jacobian.transpose() * term.jacobian;
        vector.segment(at, N) += term.jacobian.transpose() * term.target;
      }
    }
    covariance = information.inverse();
    states = covariance * vector;
  }

  Eigen::MatrixXd information;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd states;
};

template <int N>
StateChain<N> RandomChain(uint64_t seed, double loss_scale) {
  Random random(seed, 0);
  StateChain<N> chain(0.01 * Eigen::Matrix<double, N, N>::Identity());
  for (int i = 0; i < kCount; ++i) {
    std::vector<ChainTerm<N>> terms;
    for (int j = 0; j < random.Index(4); ++j) terms.push_back(RandomTerm<N>(&random, loss_scale));
    chain.Append(RandomLink<N>(&random), std::move(terms), Eigen::Matrix<double, N, 1>::Zero());
    chain.Solve(chain.size() - 1, 1, false);
  }
  return chain;
}

template <int N>
void ExpectEqualsDense(uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed << ", N " << N);
  StateChain<N> chain = RandomChain<N>(seed, 0.0);
  const Dense<N> dense(chain);
  chain.Solve(0, 1, false);
  for (int i = 0; i < kCount; ++i) {
    const auto state = chain.state(static_cast<size_t>(i));
    EXPECT_LT((state - dense.states.template segment<N>(i * N)).norm(), 1e-7);
    const auto block = dense.covariance.template block<N, N>(i * N, i * N);
    EXPECT_LT((chain.covariance(static_cast<size_t>(i)) - block).norm(), 1e-7 * block.norm());
  }
}

TEST(StateChain, EqualsTheDenseSolutionOfTheWhole) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    ExpectEqualsDense<1>(seed);
    ExpectEqualsDense<3>(seed);
    ExpectEqualsDense<7>(seed);
  }
}

TEST(StateChain, KnowsItsEndAsWellFromASummaryOfTheRest) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    StateChain<7> chain = RandomChain<7>(seed, 0.0);
    const Dense<7> dense(chain);
    chain.Solve(kCount - 4, 1, false);
    for (int i = kCount - 4; i < kCount; ++i) {
      const auto state = chain.state(static_cast<size_t>(i));
      EXPECT_LT((state - dense.states.segment<7>(i * 7)).norm(), 1e-7);
    }
  }
}

TEST(StateChain, ComesWithLossToWhereCeresComes) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    StateChain<7> own = RandomChain<7>(seed, 2.0);
    StateChain<7> theirs = own;
    own.Solve(0, 300, false);
    ASSERT_TRUE(SolveWithCeres(&theirs));
    for (size_t i = 0; i < own.size(); ++i) {
      EXPECT_LT((own.state(i) - theirs.state(i)).norm(), 1e-2);
    }
  }
}

TEST(StateChain, TakesAnglesTheShortWayRound) {
  StateChain<1> chain(Eigen::Matrix<double, 1, 1>::Constant(0.1));
  for (const double seen : {3.1, -3.1, 3.0, -3.0}) {
    ChainTerm<1> term;
    term.jacobian(0, 0) = 10.0;
    term.target(0) = 10.0 * seen;
    term.period = 10.0 * 2.0 * 3.14159265358979;
    ChainLink<1> link;
    link.covariance(0, 0) = 0.01;
    chain.Append(link, {term}, Eigen::Matrix<double, 1, 1>::Constant(seen));
    chain.Solve(0, 5, false);
  }
  for (size_t i = 0; i < chain.size(); ++i) EXPECT_LT(std::cos(chain.state(i)(0)), -0.99);
}

}  // namespace
}  // namespace dsg::ingest
