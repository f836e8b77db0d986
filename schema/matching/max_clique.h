// SPDX-License-Identifier: Apache-2.0
// The largest set of vertices of a graph that are all joined to each other.
// Refuses to run without end: a limit in steps of work, and it says when it was cut off.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/matching/bitset_graph.h"

namespace dsg {

struct CliqueOptions {
  /// A step is one vertex given a colour or one row of neighbours copied.
  int64_t step_count_max = 20'000'000;
  /// Only cliques larger than this count.
  int size_above = 0;
};

struct Clique {
  /// Ascending; empty when the graph has no clique of more than `size_above`.
  std::vector<int> vertices;
  /// False when the search was cut off; a larger one may exist.
  bool is_maximal = true;
  int64_t step_count = 0;
};

/// Greedy cliques from the vertices of highest core, then branch and bound in degeneracy order,
/// bounded by greedy colourings.
///
/// Cost: exponential at worst, bounded by `step_count_max`.
/// Source: Rossi et al., 2015 (core order); San Segundo et al., 2011 (bitset colouring).
Clique FindMaxClique(const BitsetGraph& graph, const CliqueOptions& options);

}  // namespace dsg
