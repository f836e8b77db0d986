// SPDX-License-Identifier: Apache-2.0
// The rotations of a torso, with roll and pitch: each detection is a prior, and each link says that
// nobody turned meanwhile. Beside a StateChain of the positions it is a pose graph in SE(3): noise
// of links is isotropic, so that neither half says anything of the other one.
// Source: RSS 2020, section IV-A "Human Nodes".
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "ingest/agents/estimation/state_chain.h"
#include "ingest/agents/estimation/torso_options.h"
#include "ingest/agents/person_observation.h"

namespace dsg::ingest {

/// Threads: one caller at a time. Deterministic.
class AttitudeChain {
 public:
  explicit AttitudeChain(const TorsoOptions& options) : options_(options) {}

  /// `step_s` since the one before (of the first one it says nothing). A detection without a
  /// heading has no prior: it is turned as the one before.
  void Append(const PersonObservation& observation, double step_s);

  /// As StateChain::Solve: Gauss-Newton, linearised anew at each iteration.
  void Solve(size_t first, int iteration_count, bool is_first_without_loss);

  /// Map from torso.
  const Eigen::Quaterniond& rotation(size_t i) const { return nodes_[i].map_Q_torso; }
  /// Of a small turn about the torso's axes (right perturbation), square radians.
  Eigen::Matrix3d covariance(size_t i) const;
  /// Of each axis of the link before node i, square radians.
  double link_variance(size_t i) const { return chain_->link(i).covariance(0, 0); }

 private:
  struct Node {
    Eigen::Quaterniond map_Q_torso;
    Eigen::Quaterniond detected;
    /// 0 = the detection gives no rotation.
    double heading_sigma_rad = 0.0;
  };

  void Linearise(size_t first);
  ChainTerm<3> PriorAt(const Node& node, const Eigen::Vector3d& turned_map) const;

  TorsoOptions options_;
  std::vector<Node> nodes_;
  /// How far each node has turned since the first one, summed up over small turns about axes of the
  /// map: of neighbours the difference is what the link between them weighs, to first order.
  std::optional<StateChain<3>> chain_;
};

}  // namespace dsg::ingest
