// SPDX-License-Identifier: Apache-2.0
// Which correspondences could belong to one motion, judged two by two, and at which scale.
// Refuses to know rotation and translation: differences of points are free of the one, their
// lengths of the other.
#pragma once

#include "schema/matching/bitset_graph.h"
#include "schema/matching/gnc_rotation.h"

namespace dsg {

struct ConsistencyOptions {
  double noise_bound_m = 0.05;
  /// Horizontal lengths and vertical differences are kept apart.
  bool is_upright = false;
};

/// Two correspondences are joined when the distance of their sources and that of their targets
/// differ by no more than twice the noise bound. Correspondences that share a source or target
/// point are not joined.
///
/// Requires: one column per correspondence; sources scaled already.
/// Cost: quadratic.
BitsetGraph MakeConsistencyGraph(const Columns& sources, const Columns& targets,
                                 const ConsistencyOptions& options);

/// The scale most pairs of correspondences agree on, 1 without any pair.
///
/// Cost: n^2 log n; of many correspondences a regular part of the pairs is used.
double VoteOnScale(const Columns& sources, const Columns& targets, double noise_bound_m);

}  // namespace dsg
