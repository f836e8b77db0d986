// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/state_chain.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

/// Of a positive definite matrix. Eigen's triangular solves pack even small matrices into buffers;
/// these loops take a third of the time.
template <int N>
Eigen::Matrix<double, N, N> Inverse(const Eigen::Matrix<double, N, N>& matrix) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(matrix);
  const Eigen::Matrix<double, N, N>& lower = llt.matrixLLT();
  Eigen::Matrix<double, N, N> root = Eigen::Matrix<double, N, N>::Zero();
  for (int column = 0; column < N; ++column) {
    root(column, column) = 1.0 / lower(column, column);
    for (int row = column + 1; row < N; ++row) {
      double sum = 0.0;
      for (int k = column; k < row; ++k) sum += lower(row, k) * root(k, column);
      root(row, column) = -sum / lower(row, row);
    }
  }
  return root.transpose() * root;
}

}  // namespace

template <int N>
Eigen::Vector3d ChainTerm<N>::Residual(const Eigen::Matrix<double, N, 1>& state) const {
  Eigen::Vector3d residual = jacobian * state - target;
  if (period > 0.0) residual.x() = std::remainder(residual.x(), period);
  return residual;
}

template <int N>
double ChainTerm<N>::Weight(const Eigen::Vector3d& residual) const {
  if (loss_scale <= 0.0) return 1.0;
  return 1.0 / (1.0 + residual.squaredNorm() / (loss_scale * loss_scale));
}

template <int N>
StateChain<N>::StateChain(const Matrix& initial_information)
    : initial_information_(initial_information) {}

template <int N>
void StateChain<N>::Append(const ChainLink<N>& link, std::vector<ChainTerm<N>> terms,
                           const State& start) {
  Node node;
  node.link = link;
  node.link_information = Inverse<N>(link.covariance);
  node.terms = std::move(terms);
  node.state = nodes_.empty() ? start : State(link.transition * nodes_.back().state);
  nodes_.push_back(std::move(node));
}

template <int N>
void StateChain<N>::Forward(size_t i, bool is_without_loss) {
  Node& node = nodes_[i];
  if (i == 0) {
    node.information = initial_information_;
    node.information_state.setZero();
  } else {
    const Node& before = nodes_[i - 1];
    // Schur complement of the state before, whose gain is (A + F'WF)^-1 F'W.
    const Matrix weighted = node.link_information * node.link.transition;
    const Matrix predicted = node.link_information - weighted * before.gain;
    node.information = 0.5 * (predicted + predicted.transpose());
    node.information_state = before.gain.transpose() * before.information_state;
  }
  for (const ChainTerm<N>& term : node.terms) {
    const Eigen::Vector3d residual = term.Residual(node.state);
    const double weight = is_without_loss ? 1.0 : term.Weight(residual);
    const Eigen::Vector3d target = term.jacobian * node.state - residual;
    node.information += weight * (term.jacobian.transpose() * term.jacobian);
    node.information_state += weight * (term.jacobian.transpose() * target);
  }
}

template <int N>
void StateChain<N>::Eliminate(size_t i) {
  Node& node = nodes_[i];
  const Node& next = nodes_[i + 1];
  const Matrix weighted = next.link_information * next.link.transition;
  const Matrix total = node.information + next.link.transition.transpose() * weighted;
  node.given_next = Inverse<N>(total);
  node.gain = node.given_next * weighted.transpose();
  node.offset = node.given_next * node.information_state;
}

template <int N>
void StateChain<N>::Backward(size_t first) {
  Node& last = nodes_.back();
  last.covariance = Inverse<N>(last.information);
  last.state = last.covariance * last.information_state;
  for (size_t i = nodes_.size() - 1; i-- > first;) {
    nodes_[i].state = nodes_[i].offset + nodes_[i].gain * nodes_[i + 1].state;
  }
}

template <int N>
void StateChain<N>::ComputeCovariances(size_t first) {
  for (size_t i = nodes_.size() - 1; i-- > first;) {
    Node& node = nodes_[i];
    node.covariance =
        node.given_next + node.gain * nodes_[i + 1].covariance * node.gain.transpose();
  }
}

template <int N>
void StateChain<N>::Solve(size_t first, int iteration_count, bool is_first_without_loss) {
  DSG_CHECK(first < nodes_.size());
  for (int iteration = 0; iteration < iteration_count; ++iteration) {
    for (size_t i = first; i < nodes_.size(); ++i) {
      if (i > 0) Eliminate(i - 1);
      Forward(i, iteration == 0 && is_first_without_loss);
    }
    Backward(first);
  }
  ComputeCovariances(first);
}

template struct ChainTerm<1>;
template struct ChainTerm<3>;
template struct ChainTerm<7>;
template class StateChain<1>;
template class StateChain<3>;
template class StateChain<7>;

}  // namespace dsg::ingest
