// SPDX-License-Identifier: Apache-2.0
// Robust least squares on a chain of states, each linked to the one before: the whole chain, or its
// end while what came before is kept as a summary. Refuses loops, and terms that are not linear.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace dsg::ingest {

/// One thing said of one state, in standard deviations: residual = jacobian * state - target. Rows
/// that are not needed are zero.
template <int N>
struct ChainTerm {
  Eigen::Matrix<double, 3, N> jacobian = Eigen::Matrix<double, 3, N>::Zero();
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  /// Of Cauchy's loss; 0 = squares.
  double loss_scale = 0.0;
  /// Of the first row, for angles; 0 = none.
  double period = 0.0;

  Eigen::Vector3d Residual(const Eigen::Matrix<double, N, 1>& state) const;
  /// Of the residual's square at the solution; 1 without loss.
  double Weight(const Eigen::Vector3d& residual) const;
};

/// How a state comes from the one before: state = transition * before + noise.
template <int N>
struct ChainLink {
  Eigen::Matrix<double, N, N> transition = Eigen::Matrix<double, N, N>::Identity();
  Eigen::Matrix<double, N, N> covariance = Eigen::Matrix<double, N, N>::Identity();
};

/// Instantiated for 1, 3 and 7. Ceres needs 0.2 to 0.5 ms for a window of 10 to 20 states, most of
/// it to set the problem up; this needs less than a third.
///
/// Threads: one caller at a time. Deterministic.
template <int N>
class StateChain {
 public:
  using State = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  /// The belief before the first state's terms: zero, with this information (positive definite).
  explicit StateChain(const Matrix& initial_information);

  /// The link of the first state is not used. The state starts where the link puts it; the first
  /// where `start` is.
  void Append(const ChainLink<N>& link, std::vector<ChainTerm<N>> terms, const State& start);

  /// Gauss-Newton with reweighting on the states from `first` on. What came before counts with the
  /// weights that it had when it was last solved. Computes the covariances of these states.
  ///
  /// Requires: first < size(); states before were solved once.
  /// Cost: about 3 microseconds a state and iteration at N = 7.
  void Solve(size_t first, int iteration_count, bool is_first_without_loss);

  size_t size() const { return nodes_.size(); }
  const State& state(size_t i) const { return nodes_[i].state; }
  const Matrix& covariance(size_t i) const { return nodes_[i].covariance; }
  const ChainLink<N>& link(size_t i) const { return nodes_[i].link; }
  const std::vector<ChainTerm<N>>& terms(size_t i) const { return nodes_[i].terms; }
  const Matrix& initial_information() const { return initial_information_; }
  /// Of the link's noise.
  const Matrix& link_information(size_t i) const { return nodes_[i].link_information; }
  /// Requires: term < terms(i).size(). Counts from the next solve on.
  void ReplaceTerm(size_t i, size_t term, const ChainTerm<N>& by) { nodes_[i].terms[term] = by; }
  /// For another solver.
  State* mutable_state(size_t i) { return &nodes_[i].state; }

 private:
  struct Node {
    ChainLink<N> link;
    Matrix link_information = Matrix::Identity();
    std::vector<ChainTerm<N>> terms;
    State state = State::Zero();
    Matrix covariance = Matrix::Identity();
    /// All that is known of this state from itself and those before.
    Matrix information = Matrix::Zero();
    State information_state = State::Zero();
    /// Of the state when the next one is known: mean = offset + gain * next.
    Matrix given_next = Matrix::Zero();
    Matrix gain = Matrix::Zero();
    State offset = State::Zero();
  };

  void Forward(size_t i, bool is_without_loss);
  void Eliminate(size_t i);
  void Backward(size_t first);
  void ComputeCovariances(size_t first);

  Matrix initial_information_;
  std::vector<Node> nodes_;
};

extern template class StateChain<1>;
extern template class StateChain<3>;
extern template class StateChain<7>;
extern template struct ChainTerm<1>;
extern template struct ChainTerm<3>;
extern template struct ChainTerm<7>;

}  // namespace dsg::ingest
