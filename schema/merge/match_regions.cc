// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "schema/merge/footprint.h"
#include "schema/merge/match_nodes.h"

namespace dsg::merge {
namespace {

// Regions whose heights share less than this of the lower one are on different storeys.
constexpr double kHeightShareMin = 0.5;
constexpr double kChildShareMin = 0.5;
// A building that touches another one by a tenth is the same building.
constexpr double kBuildingOverlapMin = 0.1;

bool AreOnOneStorey(const Node& a, const Node& b) {
  const HeightSpan ha = HeightsOf(a);
  const HeightSpan hb = HeightsOf(b);
  const double shared = std::min(ha.z_max_m, hb.z_max_m) - std::max(ha.z_min_m, hb.z_min_m);
  const double lower = std::min(ha.z_max_m - ha.z_min_m, hb.z_max_m - hb.z_min_m);
  if (lower <= 0.0) return std::abs(ha.z_min_m - hb.z_min_m) < 1.0;
  return shared > kHeightShareMin * lower;
}

// By pair of regions: how many children of the one became children of the other.
using SharedChildren = std::map<std::pair<int, int>, int>;

struct Children {
  SharedChildren shared;
  std::map<int, int> of_into;
  std::map<int, int> of_other;
};

Children CountChildren(const MapContent& into, const MapContent& other,
                       const std::vector<int>& pair_of) {
  Children children;
  for (const int parent : into.parent) ++children.of_into[parent];
  for (size_t i = 0; i < other.nodes.size(); ++i) {
    const int parent = other.parent[i];
    if (parent < 0) continue;
    ++children.of_other[parent];
    if (pair_of[i] < 0) continue;
    const int home = into.parent[static_cast<size_t>(pair_of[i])];
    if (home >= 0) ++children.shared[{home, parent}];
  }
  return children;
}

double ChildShare(const Children& children, int into, int other) {
  const auto shared = children.shared.find({into, other});
  if (shared == children.shared.end()) return 0.0;
  const int fewer = std::min(children.of_into.at(into), children.of_other.at(other));
  return static_cast<double>(shared->second) / fewer;
}

double OverlapNeeded(const Node& a, const Node& b, int32_t rank, const MatchOptions& options) {
  if (rank > 400) return kBuildingOverlapMin;
  const bool is_same_class = !ClassKey(a).empty() && ClassKey(a) == ClassKey(b);
  return is_same_class ? options.room_overlap_min_same_class : options.room_overlap_min;
}

// From 0 to 1, and up to 2 where what they contain is shared too; 0 for strangers.
double Likeness(const Node& known, const Node& node, double child_share, double overlap_needed) {
  if (known.layer != node.layer || known.kind != node.kind) return 0.0;
  const Polygon2d a = FootprintOf(known);
  const Polygon2d b = FootprintOf(node);
  const double smaller = std::min(AreaOf(a), AreaOf(b));
  double overlap = 0.0;
  if (smaller > 0.0 && AreOnOneStorey(known, node)) overlap = SharedArea(a, b) / smaller;
  if (overlap < overlap_needed && child_share < kChildShareMin) return 0.0;
  return overlap + child_share;
}

}  // namespace

void MatchRegions(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of) {
  const auto rank = [&](const MapContent& content, int i) {
    const auto found = content.rank_of.find(content.nodes[static_cast<size_t>(i)].layer);
    return found == content.rank_of.end() ? 0 : found->second;
  };
  const std::vector<int> mine = into.OfClass(NodeClass::kRegion);
  std::vector<int> theirs = other.OfClass(NodeClass::kRegion);
  std::stable_sort(theirs.begin(), theirs.end(),
                   [&](int a, int b) { return rank(other, a) < rank(other, b); });
  Children children = CountChildren(into, other, *pair_of);
  int32_t counted_rank = 0;
  for (const int i : theirs) {
    if (rank(other, i) != counted_rank) {
      // What was paired on the layer below counts as shared on this one.
      children = CountChildren(into, other, *pair_of);
      counted_rank = rank(other, i);
    }
    int& pair = (*pair_of)[static_cast<size_t>(i)];
    if (pair >= 0) continue;
    const Node& node = other.nodes[static_cast<size_t>(i)];
    double best = 0.0;
    for (const int candidate : mine) {
      const Node& known = into.nodes[static_cast<size_t>(candidate)];
      const double likeness = Likeness(known, node, ChildShare(children, candidate, i),
                                       OverlapNeeded(known, node, rank(other, i), options));
      if (likeness <= best) continue;
      best = likeness;
      pair = candidate;
    }
  }
}

}  // namespace dsg::merge
