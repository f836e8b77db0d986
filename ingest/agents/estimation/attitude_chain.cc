// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/estimation/attitude_chain.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

// Of the first rotation: far below any detection, and where no detection tells it, half a turn.
constexpr double kWeakTurnInformation = 1e-8;
constexpr double kUnknownInformation = 1.0 / (std::numbers::pi * std::numbers::pi);

// Nothing moves any more.
constexpr double kSettledRad = 1e-10;

// About axes of the map.
Eigen::Vector3d TurnBetween(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  return RotationVectorOf((to * from.conjugate()).normalized());
}

}  // namespace

void AttitudeChain::Append(const PersonObservation& observation, double step_s) {
  Node node;
  node.detected = observation.map_T_torso.orientation.normalized();
  node.heading_sigma_rad = observation.has_heading ? observation.heading_sigma_rad : 0.0;
  const bool has_prior = node.heading_sigma_rad > 0.0;
  if (!chain_.has_value()) {
    const double information = has_prior ? kWeakTurnInformation : kUnknownInformation;
    chain_.emplace(information * Eigen::Matrix3d::Identity());
  }
  const bool starts = has_prior || nodes_.empty();
  node.map_Q_torso = starts ? node.detected : nodes_.back().map_Q_torso;
  nodes_.push_back(node);
  ChainLink<3> link;
  const double sigma_rad = options_.turn_sigma_rad_s * step_s;
  link.covariance = sigma_rad * sigma_rad * Eigen::Matrix3d::Identity();
  std::vector<ChainTerm<3>> terms;
  if (has_prior) terms.push_back(PriorAt(node, Eigen::Vector3d::Zero()));
  chain_->Append(link, std::move(terms), Eigen::Vector3d::Zero());
}

void AttitudeChain::Solve(size_t first, int iteration_count, bool is_first_without_loss) {
  std::vector<Eigen::Vector3d> before;
  for (int iteration = 0; iteration < iteration_count; ++iteration) {
    Linearise(first);
    before.clear();
    for (size_t i = first; i < nodes_.size(); ++i) before.push_back(chain_->state(i));
    chain_->Solve(first, 1, iteration == 0 && is_first_without_loss);
    double largest_rad = 0.0;
    for (size_t i = first; i < nodes_.size(); ++i) {
      const Eigen::Vector3d turn_map = chain_->state(i) - before[i - first];
      largest_rad = std::max(largest_rad, turn_map.norm());
      nodes_[i].map_Q_torso = (RotationOf(turn_map) * nodes_[i].map_Q_torso).normalized();
    }
    if (largest_rad < kSettledRad) break;
  }
}

Eigen::Matrix3d AttitudeChain::covariance(size_t i) const {
  const Eigen::Matrix3d map_R_torso = nodes_[i].map_Q_torso.toRotationMatrix();
  return map_R_torso.transpose() * chain_->covariance(i) * map_R_torso;
}

// Nodes before `first` keep what they had turned by; what they know is told in these numbers.
void AttitudeChain::Linearise(size_t first) {
  for (size_t i = first; i < nodes_.size(); ++i) {
    Eigen::Vector3d turned_map = Eigen::Vector3d::Zero();
    if (i > 0) {
      turned_map =
          chain_->state(i - 1) + TurnBetween(nodes_[i - 1].map_Q_torso, nodes_[i].map_Q_torso);
    }
    *chain_->mutable_state(i) = turned_map;
    if (nodes_[i].heading_sigma_rad > 0.0)
      chain_->ReplaceTerm(i, 0, PriorAt(nodes_[i], turned_map));
  }
}

// In standard deviations about the detection's axes: roll, pitch, heading.
ChainTerm<3> AttitudeChain::PriorAt(const Node& node, const Eigen::Vector3d& turned_map) const {
  const Eigen::Vector3d off_map = TurnBetween(node.detected, node.map_Q_torso);
  const Eigen::Vector3d sigma_rad(options_.tilt_sigma_rad, options_.tilt_sigma_rad,
                                  node.heading_sigma_rad);
  const Eigen::Matrix3d whitening =
      sigma_rad.cwiseInverse().asDiagonal() * node.detected.toRotationMatrix().transpose();
  ChainTerm<3> term;
  term.loss_scale = options_.paper_loss_scale;
  // A small turn on the left of a rotation changes its logarithm by the transpose.
  term.jacobian = whitening * InverseRightJacobian(off_map).transpose();
  term.target = term.jacobian * turned_map - whitening * off_map;
  return term;
}

}  // namespace dsg::ingest
