// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/loop_support.h"

#include "ingest/loop/odometry_tree.h"
#include "ingest/loop/pairwise.h"
#include "schema/matching/max_clique.h"

namespace dsg::ingest {
namespace {

// Minus the logarithm of the chance that a loop found its support by accident.
constexpr double kSupportMin = 14.0;
// Twice the standard deviations that the gate allows: here the largest set is for throwing out
// liars, and not for losing one right loop in a hundred from every comparison.
constexpr double kDisagreementFactor = 4.0;

// Odometry, and the largest set of `vertices` of `agreement` that agree in pairs.
std::vector<bool> LargestAgreeing(const PoseGraph& graph, const LoopAgreement& agreement,
                                  const std::vector<int>& vertices) {
  const int count = static_cast<int>(vertices.size());
  BitsetGraph agrees(count);
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < a; ++b) {
      if (agreement.agrees.HasEdge(vertices[Index(a)], vertices[Index(b)])) agrees.AddEdge(a, b);
    }
  }
  std::vector<bool> is_member;
  for (const RelativePose& edge : graph.edges) is_member.push_back(!edge.is_loop);
  for (const int member : FindMaxClique(agrees, {}).vertices) {
    is_member[Index(agreement.edges[Index(vertices[Index(member)])])] = true;
  }
  return is_member;
}

// The largest set among loops that agree with odometry and that `is_wanted` (by vertex) takes.
template <typename IsWanted>
std::vector<bool> LargestOf(const PoseGraph& graph, const PairwiseOptions& options,
                            IsWanted is_wanted) {
  const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
  std::vector<int> vertices;
  for (size_t k = 0; k < agreement.edges.size(); ++k) {
    if (agreement.agrees_with_odometry[k] && is_wanted(agreement, k)) {
      vertices.push_back(static_cast<int>(k));
    }
  }
  return LargestAgreeing(graph, agreement, vertices);
}

}  // namespace

std::vector<bool> LikelyEdges(const PoseGraph& graph, double gate) {
  PairwiseOptions options;
  options.gate = gate;
  options.disagreement_factor = kDisagreementFactor;
  return LargestOf(graph, options, [](const LoopAgreement& agreement, size_t k) {
    return agreement.support[k] >= kSupportMin;
  });
}

std::vector<bool> SupportedEdges(const PoseGraph& graph, double gate, double noise_scale,
                                 double wrong_count_max) {
  PairwiseOptions options;
  options.gate = gate;
  options.noise_scale = noise_scale;
  options.disagreement_factor = kDisagreementFactor;
  return LargestOf(graph, options, [wrong_count_max](const LoopAgreement& agreement, size_t k) {
    return agreement.accident_count[k] <= wrong_count_max;
  });
}

std::vector<bool> ConsistentEdges(const PoseGraph& graph, double gate) {
  PairwiseOptions options;
  options.gate = gate;
  return LargestOf(graph, options, [](const LoopAgreement&, size_t) { return true; });
}

}  // namespace dsg::ingest
