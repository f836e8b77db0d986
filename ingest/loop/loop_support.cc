// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/loop_support.h"

#include <map>
#include <utility>

#include "ingest/loop/odometry_tree.h"
#include "ingest/loop/pairwise.h"
#include "schema/base/disjoint_sets.h"
#include "schema/matching/max_clique.h"

namespace dsg::ingest {
namespace {

// Members of `group`, ascending loops, that agree in pairs: as many as possible.
std::vector<int> LargestAgreeingOf(const std::vector<int>& group,
                                   const std::vector<std::pair<int, int>>& disagreements) {
  const int count = static_cast<int>(group.size());
  std::map<int, int> number;
  for (int i = 0; i < count; ++i) number[group[Index(i)]] = i;
  BitsetGraph disagrees(count);
  for (const auto& [a, b] : disagreements) disagrees.AddEdge(number.at(a), number.at(b));
  BitsetGraph agrees(count);
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < a; ++b) {
      if (!disagrees.HasEdge(a, b)) agrees.AddEdge(a, b);
    }
  }
  std::vector<int> members;
  for (const int member : FindMaxClique(agrees, {}).vertices) {
    members.push_back(group[Index(member)]);
  }
  return members;
}

// Odometry, and the largest set of loops of `is_wanted` that agree in pairs. Who agrees with all
// others is in it anyway, and groups that disagree only among themselves are searched one by one.
std::vector<bool> LargestAgreeing(const PoseGraph& graph, const LoopAgreement& agreement,
                                  const std::vector<bool>& is_wanted, const TellWork& on_work) {
  DisjointSets sets(is_wanted.size());
  for (const auto& [a, b] : agreement.disagreements) {
    if (is_wanted[Index(a)] && is_wanted[Index(b)]) sets.Merge(a, b);
  }
  std::map<int, std::vector<std::pair<int, int>>> disagreements;
  for (const auto& [a, b] : agreement.disagreements) {
    if (is_wanted[Index(a)] && is_wanted[Index(b)]) disagreements[sets.Find(a)].emplace_back(a, b);
  }
  std::map<int, std::vector<int>> groups;
  for (size_t k = 0; k < is_wanted.size(); ++k) {
    const int loop = static_cast<int>(k);
    if (is_wanted[k]) groups[sets.Find(loop)].push_back(loop);
  }
  std::vector<bool> is_member;
  for (const RelativePose& edge : graph.edges) is_member.push_back(!edge.is_loop);
  int64_t done = 0;
  for (const auto& [first, group] : groups) {
    if (on_work) on_work("choosing loop closures that agree", done, std::ssize(is_wanted));
    done += std::ssize(group);
    const std::vector<int> members =
        group.size() == 1 ? group : LargestAgreeingOf(group, disagreements.at(first));
    for (const int loop : members) is_member[Index(agreement.edges[Index(loop)])] = true;
  }
  return is_member;
}

// The largest set among loops that agree with odometry and that `is_wanted` (by loop) takes.
template <typename IsWanted>
std::vector<bool> LargestOf(const PoseGraph& graph, const PairwiseOptions& options,
                            IsWanted is_wanted) {
  const LoopAgreement agreement = CompareLoops(graph, OdometryTree(graph), options);
  std::vector<bool> wanted;
  for (size_t k = 0; k < agreement.edges.size(); ++k) {
    wanted.push_back(agreement.agrees_with_odometry[k] && is_wanted(agreement, k));
  }
  return LargestAgreeing(graph, agreement, wanted, options.on_work);
}

}  // namespace

std::vector<bool> LikelyEdges(const PoseGraph& graph, double gate, const EvidenceOptions& evidence,
                              const TellWork& on_work) {
  PairwiseOptions options;
  options.gate = gate;
  options.disagreement_factor = evidence.disagreement_factor;
  options.evidence = evidence;
  options.on_work = on_work;
  return LargestOf(graph, options, [&evidence](const LoopAgreement& agreement, size_t k) {
    return agreement.support[k] >= evidence.support_min;
  });
}

std::vector<bool> SupportedEdges(const PoseGraph& graph, double gate, double noise_scale,
                                 double wrong_count_max, const EvidenceOptions& evidence,
                                 const TellWork& on_work) {
  PairwiseOptions options;
  options.gate = gate;
  options.noise_scale = noise_scale;
  options.disagreement_factor = evidence.disagreement_factor;
  options.evidence = evidence;
  options.on_work = on_work;
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
