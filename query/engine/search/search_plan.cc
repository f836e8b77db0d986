// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/search_plan.h"

#include <algorithm>

namespace dsg::query {
namespace {

// Nodes that are looked at to learn how many touch a box.
constexpr int64_t kBoxProbeMax = 512;
// How many nodes one node leads to: by edges of one relation, down a hierarchy, and up. Rough, but
// what is chosen wrongly costs time only.
constexpr double kEdgesPerNode = 8.0;
constexpr double kNodesBelow = 200.0;
constexpr double kNodesAbove = 4.0;
// Against looking at one node of an index: following an edge.
constexpr double kJoinCost = 2.0;
// Nodes that share a name, letter case ignored.
constexpr double kNamesakes = 2.0;

double FanOut(const CompiledRelation& relation) {
  if (relation.how == CompiledRelation::How::kEdge) return kEdgesPerNode;
  return relation.reversed ? kNodesAbove : kNodesBelow;
}

bool IsLiteral(const std::string& name) { return name.find('*') == std::string::npos; }

void SortUnique(std::vector<NodeId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

}  // namespace

SpaceFilter SpaceFilterOf(const CompiledPattern& pattern) {
  SpaceFilter filter;
  filter.layer = pattern.layer;
  if (!pattern.has_class() || pattern.classes.empty()) return filter;
  const Symbol first = pattern.classes.front().class_name;
  const bool is_one =
      std::all_of(pattern.classes.begin(), pattern.classes.end(),
                  [first](const ClassRange& range) { return range.class_name == first; });
  if (!is_one) return filter;
  filter.class_name = first;
  if (pattern.classes.size() == 1) filter.layer = pattern.classes.front().layer;
  return filter;
}

int64_t Planner::CountInLayer(LayerId layer) const {
  int64_t count = 0;
  for (const auto& [class_name, of_class] : view_.ClassesOf(layer)) count += of_class;
  return count;
}

double Planner::EstimateMatches(const CompiledPattern& pattern) const {
  if (pattern.is_never) return 0.0;
  if (pattern.id.has_value()) return 1.0;
  double estimate = static_cast<double>(view_.node_count());
  if (pattern.has_class()) {
    estimate = 0.0;
    for (const ClassRange& range : pattern.classes) {
      estimate += static_cast<double>(range.node_count);
    }
  } else if (pattern.layer.has_value()) {
    estimate = static_cast<double>(CountInLayer(*pattern.layer));
  }
  if (pattern.has_name() && IsLiteral(pattern.source.name)) {
    estimate = std::min(estimate, kNamesakes);
  }
  return estimate;
}

std::optional<PlanStart> Planner::BoxStart(const CompiledPattern& pattern,
                                           const std::optional<Box3d>& box_map,
                                           double best_cost) const {
  if (!box_map.has_value() || pattern.asks_for_agents) return std::nullopt;
  int64_t count = 0;
  view_.ForEachTouching(*box_map, SpaceFilterOf(pattern), [&](const ViewNode&) {
    return ++count < kBoxProbeMax && static_cast<double>(count) < best_cost;
  });
  PlanStart start{PlanStart::Kind::kBox, 0, static_cast<double>(count)};
  // Cut short: there are more, nobody knows how many.
  if (count >= kBoxProbeMax) start.cost = std::max(start.cost, 0.25 * best_cost);
  return start;
}

PlanStart Planner::ChooseStart(const CompiledPattern& pattern,
                               const std::optional<Box3d>& box_map) const {
  using Kind = PlanStart::Kind;
  if (pattern.is_never) return {Kind::kNothing, 0, 0.0};
  if (pattern.id.has_value()) return {Kind::kId, 0, 1.0};
  PlanStart best{Kind::kScan, 0, static_cast<double>(view_.node_count())};
  const auto consider = [&best](const PlanStart& start) {
    if (start.cost < best.cost) best = start;
  };
  if (pattern.has_class()) {
    double count = 0.0;
    for (const ClassRange& range : pattern.classes) count += static_cast<double>(range.node_count);
    consider({Kind::kClass, 0, count});
  } else if (pattern.layer.has_value()) {
    consider({Kind::kLayer, 0, static_cast<double>(CountInLayer(*pattern.layer))});
  }
  if (pattern.has_name() && IsLiteral(pattern.source.name)) {
    consider({Kind::kName, 0, kNamesakes});
  }
  for (size_t i = 0; i < pattern.relations.size(); ++i) {
    const CompiledRelation& relation = pattern.relations[i];
    if (relation.negated) continue;
    const double others = EstimateMatches(*relation.other);
    if (others * kJoinCost >= best.cost) continue;
    const double cost =
        ChooseStart(*relation.other, std::nullopt).cost + kJoinCost * others * FanOut(relation);
    consider({Kind::kJoin, i, cost});
  }
  if (const auto box = BoxStart(pattern, box_map, best.cost)) consider(*box);
  return best;
}

void Planner::AddStep(const char* operation, std::string detail, int64_t in_count,
                      int64_t out_count) {
  if (steps_ != nullptr) steps_->push_back({operation, std::move(detail), in_count, out_count});
}

std::vector<NodeId> Planner::Candidates(const CompiledPattern& pattern, const PlanStart& start,
                                        const std::optional<Box3d>& box_map, NodeId after) {
  std::vector<NodeId> ids;
  int64_t seen_count = 0;
  const auto take = [&](const ViewNode& node) {
    ++seen_count;
    if (node.id > after) ids.push_back(node.id);
    return matcher_->Tick();
  };
  const char* operation = "none";
  std::string detail;
  switch (start.kind) {
    case PlanStart::Kind::kNothing:
      detail = "nothing of this revision can match";
      break;
    case PlanStart::Kind::kId:
      operation = "id";
      detail = pattern.source.id;
      take(*view_.FindNode(*pattern.id));
      break;
    case PlanStart::Kind::kClass:
      operation = "class index";
      detail = pattern.source.class_name;
      for (const ClassRange& range : pattern.classes) {
        view_.ForEachOfClass(range.layer, range.class_name, take);
      }
      break;
    case PlanStart::Kind::kLayer:
      operation = "layer index";
      detail = pattern.source.layer.empty() ? pattern.source.kind : pattern.source.layer;
      view_.ForEachInLayer(*pattern.layer, take);
      break;
    case PlanStart::Kind::kBox:
      operation = "box";
      view_.ForEachTouching(*box_map, SpaceFilterOf(pattern), take);
      break;
    case PlanStart::Kind::kName:
      operation = "name index";
      detail = pattern.source.name;
      for (const NodeId id : view_.NodesNamedIgnoringCase(pattern.source.name)) {
        if (!take(*view_.FindNode(id))) break;
      }
      break;
    case PlanStart::Kind::kJoin: {
      const CompiledRelation& relation = pattern.relations[start.relation];
      ids = Join(pattern, relation);
      ids.erase(ids.begin(), std::upper_bound(ids.begin(), ids.end(), after));
      return ids;
    }
    case PlanStart::Kind::kScan:
      operation = "scan";
      view_.ForEachNode(after, take);
      break;
  }
  AddStep(operation, std::move(detail), seen_count, static_cast<int64_t>(ids.size()));
  SortUnique(&ids);
  return ids;
}

std::vector<NodeId> Planner::Join(const CompiledPattern& pattern,
                                  const CompiledRelation& relation) {
  const std::vector<NodeId> others = Collect(*relation.other);
  std::vector<NodeId> ids;
  for (const NodeId other : others) {
    matcher_->ForEachThatMayRelateTo(relation, pattern.contains, *view_.FindNode(other),
                                     [&](const ViewNode& node) {
                                       ids.push_back(node.id);
                                       return true;
                                     });
    if (!matcher_->status().ok()) return {};
  }
  SortUnique(&ids);
  const size_t index = static_cast<size_t>(&relation - pattern.relations.data());
  const RelationCondition& condition = pattern.source.relations[index];
  AddStep("join", condition.relation + (condition.reversed ? " reversed" : ""),
          static_cast<int64_t>(others.size()), static_cast<int64_t>(ids.size()));
  return ids;
}

std::vector<NodeId> Planner::Collect(const CompiledPattern& pattern) {
  std::vector<NodeId> ids =
      Candidates(pattern, ChooseStart(pattern, std::nullopt), std::nullopt, NodeId());
  const auto candidate_count = static_cast<int64_t>(ids.size());
  std::erase_if(ids, [&](NodeId id) { return !matcher_->Matches(pattern, *view_.FindNode(id)); });
  if (!matcher_->status().ok()) return {};
  AddStep("filter", FormatQuery(pattern.source), candidate_count, static_cast<int64_t>(ids.size()));
  return ids;
}

}  // namespace dsg::query
