// SPDX-License-Identifier: Apache-2.0
// Which loops agree with which, by the cycles that two loops and the odometry between them close.
// Refuses to choose between loops that disagree; robust.h does.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "ingest/loop/odometry_tree.h"
#include "ingest/loop/pose_graph.h"
#include "ingest/loop/robust_options.h"

namespace dsg::ingest {

struct PairwiseOptions {
  /// Largest squared Mahalanobis distance of a cycle from identity.
  double gate = 16.81;
  /// Covariances are this many times what the graph says.
  double noise_scale = 1.0;
  /// Two loops disagree when the squared distance is above the gate times this.
  double disagreement_factor = 1.0;
  /// Its disagreement_factor is not used.
  EvidenceOptions evidence;
  /// May be empty.
  TellWork on_work;
};

struct LoopAgreement {
  /// Indices into PoseGraph::edges; the numbers of loops below are places in this list.
  std::vector<int> edges;
  /// Pairs of loops that disagree, the larger number first, ascending. All others agree, or were
  /// not compared.
  std::vector<std::pair<int, int>> disagreements;
  int64_t compared_count = 0;
  /// Each loop against the odometry between its ends; true where there is none.
  std::vector<bool> agrees_with_odometry;
  /// How hard it would be to agree with so many others by accident: minus the logarithm of a bound
  /// of that chance (Chernoff's, of a Poisson count). Too high where one accident makes many pairs
  /// agree, as next to a swarm of loops that say the same.
  std::vector<double> support;
  /// The accidents to be expected among all comparisons, of all loops, that tell at least as much
  /// as the one that tells most among those where this loop agreed; without end if it agreed
  /// nowhere. Comparisons that failed stand for those that wrong loops may pass.
  std::vector<double> accident_count;

  bool Agree(int a, int b) const;
};

/// The share of all relative poses that fit into `extent_m` (a box) which a gate of `gate` squared
/// deviations of such volume lets pass: the chance that a wrong measurement agrees by accident.
double AccidentChance(const Eigen::Vector3d& extent_m, bool is_planar, double gate, double volume,
                      const EvidenceOptions& evidence);

/// Threads: safe. Deterministic.
/// Cost:    some microseconds a pair that is compared. Pairs that are not, because they are too
///          many, are mostly not looked at either: loops are sorted by the odometry before them.
/// Source:  Mangelson et al. 2018.
LoopAgreement CompareLoops(const PoseGraph& graph, const OdometryTree& odometry,
                           const PairwiseOptions& options);

}  // namespace dsg::ingest
