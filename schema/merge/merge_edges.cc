// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge_edges.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "schema/merge/point_grid.h"

namespace dsg::merge {
namespace {

bool HasEnds(const std::string& relation, relations::Ends ends) {
  const relations::Relation* const known = relations::Find(relation);
  return known != nullptr && known->ends == ends;
}

// Written once, from either end.
bool IsSymmetric(const std::string& relation) {
  return HasEnds(relation, relations::Ends::kEither);
}

// A node has one of each of these; of two beliefs the one of this map stays.
bool IsSingle(const std::string& relation) { return HasEnds(relation, relations::Ends::kOne); }

// Relations that attach a node: to its parent, or by a single edge.
bool HangsOn(const std::string& relation) {
  return relation == relations::kContains || IsSingle(relation);
}

NodeId Hanging(const Edge& edge) {
  return edge.relation == relations::kContains ? edge.target : edge.source;
}

NodeId Holding(const Edge& edge) {
  return edge.relation == relations::kContains ? edge.source : edge.target;
}

Edge WithEnds(Edge edge, NodeId source, NodeId target) {
  edge.source = source;
  edge.target = target;
  return edge;
}

class EdgeJoiner {
 public:
  EdgeJoiner(const MapContent& into, const std::vector<int>& pair_of,
             const std::vector<NodeId>& id_of, const std::vector<EdgeKey>& replaced,
             const std::set<EdgeKey>& written)
      : pair_of_(pair_of), id_of_(id_of), written_(written) {
    for (const Edge& edge : into.edges) {
      if (std::binary_search(replaced.begin(), replaced.end(), edge.key())) continue;
      into_keys_.push_back(edge.key());
      if (edge.relation == relations::kContains) has_parent_.insert(edge.target);
      if (IsSingle(edge.relation)) taken_.insert({edge.source, edge.relation});
    }
  }

  void Add(const MapContent& other, const Edge& edge) {
    const int source = other.IndexOf(edge.source);
    const int target = other.IndexOf(edge.target);
    if (source < 0 || target < 0) return;
    Edge mine = edge;
    mine.source = id_of_[static_cast<size_t>(source)];
    mine.target = id_of_[static_cast<size_t>(target)];
    if (mine.source == mine.target) return;
    if (IsKnown(mine)) return;
    if (edge.relation == relations::kContains && HasParent(target)) return;
    if (IsSingle(edge.relation) && taken_.contains({mine.source, edge.relation})) return;
    mine.attributes.erase(kEdgeFrom);
    if (HangsOn(edge.relation)) mine.attributes[kEdgeFrom] = other.spec.name;
    added_.try_emplace(mine.key(), std::move(mine));
  }

  std::vector<Edge> Take() && {
    std::vector<Edge> edges;
    for (auto& [key, edge] : added_) edges.push_back(std::move(edge));
    return edges;
  }

 private:
  bool Has(const EdgeKey& key) const {
    return added_.contains(key) || written_.contains(key) ||
           std::binary_search(into_keys_.begin(), into_keys_.end(), key);
  }

  bool IsKnown(const Edge& edge) const {
    return Has(edge.key()) ||
           (IsSymmetric(edge.relation) && Has({edge.target, edge.relation, edge.source}));
  }

  // Whether a node that was in this map before the merge has a parent.
  bool HasParent(int child) const {
    const auto i = static_cast<size_t>(child);
    return pair_of_[i] >= 0 && has_parent_.contains(id_of_[i]);
  }

  const std::vector<int>& pair_of_;
  const std::vector<NodeId>& id_of_;
  const std::set<EdgeKey>& written_;
  std::vector<EdgeKey> into_keys_;
  std::set<NodeId> has_parent_;
  std::set<std::pair<NodeId, std::string>> taken_;
  std::map<EdgeKey, Edge> added_;
};

// Places of `other` with a TRAVERSABLE edge to a place that both maps have.
std::set<int> JoinedPlaces(const MapContent& other, const std::vector<int>& pair_of) {
  std::set<int> joined;
  for (const Edge& edge : other.edges) {
    if (edge.relation != relations::kTraversable) continue;
    const int a = other.IndexOf(edge.source);
    const int b = other.IndexOf(edge.target);
    if (a < 0 || b < 0) continue;
    if (pair_of[static_cast<size_t>(a)] >= 0) joined.insert(b);
    if (pair_of[static_cast<size_t>(b)] >= 0) joined.insert(a);
  }
  return joined;
}

}  // namespace

std::vector<EdgeKey> ReplacedEdges(const MapContent& into, const MapContent& other,
                                   const std::vector<NodeId>& id_of,
                                   const std::vector<char>& is_copy) {
  const std::set<NodeId> images(id_of.begin(), id_of.end());
  // The other ends that the other map has, by node and relation.
  std::map<std::pair<NodeId, std::string>, std::set<NodeId>> wanted;
  for (const Edge& edge : other.edges) {
    const int source = other.IndexOf(edge.source);
    const int target = other.IndexOf(edge.target);
    if (source < 0 || target < 0 || !HangsOn(edge.relation)) continue;
    const Edge mine =
        WithEnds(edge, id_of[static_cast<size_t>(source)], id_of[static_cast<size_t>(target)]);
    wanted[{Hanging(mine), mine.relation}].insert(Holding(mine));
  }
  std::vector<EdgeKey> replaced;
  for (const Edge& edge : into.edges) {
    if (!HangsOn(edge.relation) || !images.contains(Holding(edge))) continue;
    const auto now = wanted.find({Hanging(edge), edge.relation});
    if (now == wanted.end() || now->second.contains(Holding(edge))) continue;
    const int node = into.IndexOf(Hanging(edge));
    if (node < 0 || is_copy[static_cast<size_t>(node)] == 0) continue;
    const auto from = edge.attributes.find(kEdgeFrom);
    if (from == edge.attributes.end() || from->second != AttributeValue(other.spec.name)) continue;
    replaced.push_back(edge.key());
  }
  return replaced;
}

std::vector<Edge> JoinEdges(const MapContent& into, const MapContent& other,
                            const std::vector<int>& pair_of, const std::vector<NodeId>& id_of,
                            const std::vector<EdgeKey>& replaced,
                            const std::set<EdgeKey>& written) {
  EdgeJoiner joiner(into, pair_of, id_of, replaced, written);
  for (const Edge& edge : other.edges) joiner.Add(other, edge);
  return std::move(joiner).Take();
}

std::vector<Edge> BridgePlaces(const MapContent& into, const MapContent& other,
                               const std::vector<int>& pair_of, const std::vector<NodeId>& id_of) {
  const std::vector<int> mine = into.OfClass(NodeClass::kPlace);
  std::vector<Eigen::Vector3d> positions;
  for (const int i : mine) {
    positions.push_back(into.nodes[static_cast<size_t>(i)].map_T_node.position);
  }
  const PointGrid grid(positions, 1.0);
  const std::set<int> joined = JoinedPlaces(other, pair_of);
  std::vector<Edge> bridges;
  for (const int i : other.OfClass(NodeClass::kPlace)) {
    if (pair_of[static_cast<size_t>(i)] >= 0 || joined.contains(i)) continue;
    const Node& place = other.nodes[static_cast<size_t>(i)];
    int nearest = -1;
    double least = 3.0;
    grid.ForEachNear(place.map_T_node.position, least, [&](int k) {
      const Node& known = into.nodes[static_cast<size_t>(mine[static_cast<size_t>(k)])];
      const double distance = (known.map_T_node.position - place.map_T_node.position).norm();
      // Nine tenths: clearances are measured on a grid.
      if (distance > 0.9 * std::max(ClearanceOf(known), ClearanceOf(place))) return;
      if (distance > least || (distance == least && k > nearest)) return;
      least = distance;
      nearest = k;
    });
    if (nearest < 0) continue;
    const Node& known = into.nodes[static_cast<size_t>(mine[static_cast<size_t>(nearest)])];
    Edge bridge;
    bridge.source = std::min(known.id, id_of[static_cast<size_t>(i)]);
    bridge.relation = relations::kTraversable;
    bridge.target = std::max(known.id, id_of[static_cast<size_t>(i)]);
    bridge.weight = std::min(ClearanceOf(known), ClearanceOf(place));
    bridges.push_back(std::move(bridge));
  }
  std::sort(bridges.begin(), bridges.end(),
            [](const Edge& a, const Edge& b) { return a.key() < b.key(); });
  return bridges;
}

}  // namespace dsg::merge
