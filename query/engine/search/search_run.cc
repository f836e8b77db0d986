// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/search_run.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "query/engine/search/matcher.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/query_language.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

/// Where candidates come from.
struct PlanStart {
  enum class Kind { kNothing, kId, kClass, kLayer, kBox, kJoin, kUnion, kName, kScan };
  Kind kind = Kind::kScan;
  /// Which relation of the pattern (kJoin), or which of its alternatives (kUnion).
  size_t part = 0;
  /// Nodes that will be touched, an estimate.
  double cost = 0.0;
};

/// Threads: one caller at a time.
class Planner {
 public:
  /// Both must outlive this. `steps` may be null.
  Planner(const GraphView& view, Matcher* matcher, std::vector<PlanStep>* steps)
      : view_(view), matcher_(matcher), steps_(steps) {}

  /// `box_map`: nodes must touch it, agents do not count.
  PlanStart ChooseStart(const CompiledPattern& pattern, const std::optional<Box3d>& box_map) const;

  /// Ids above `after` that `start` finds: all that match, and others. Ascending.
  std::vector<NodeId> Candidates(const CompiledPattern& pattern, const PlanStart& start,
                                 const std::optional<Box3d>& box_map, NodeId after);

  /// All that match, wherever they are. Ascending.
  std::vector<NodeId> Collect(const CompiledPattern& pattern);

 private:
  double EstimateMatches(const CompiledPattern& pattern) const;
  int64_t CountInLayer(LayerId layer) const;
  std::optional<PlanStart> BoxStart(const CompiledPattern& pattern,
                                    const std::optional<Box3d>& box_map, double best_cost) const;
  std::vector<NodeId> Join(const CompiledPattern& pattern, const CompiledRelation& relation);
  std::vector<NodeId> Unite(const CompiledAlternatives& alternatives, NodeId after);
  void AddStep(const char* operation, std::string detail, int64_t in_count, int64_t out_count);

  const GraphView& view_;
  Matcher* matcher_;
  std::vector<PlanStep>* steps_;
};

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

// The layer and the class that an index of space can be narrowed to.
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
  for (const CompiledAlternatives& alternatives : pattern.alternatives) {
    if (alternatives.negated) continue;
    double sum = 0.0;
    for (const auto& one : alternatives.any_of) sum += EstimateMatches(*one);
    estimate = std::min(estimate, sum);
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
  if (pattern.is_never) return {PlanStart::Kind::kNothing, 0, 0.0};
  if (pattern.id.has_value()) return {PlanStart::Kind::kId, 0, 1.0};
  PlanStart best{PlanStart::Kind::kScan, 0, static_cast<double>(view_.node_count())};
  const auto consider = [&best](const PlanStart& start) {
    if (start.cost < best.cost) best = start;
  };
  if (pattern.has_class()) {
    double count = 0.0;
    for (const ClassRange& range : pattern.classes) count += static_cast<double>(range.node_count);
    consider({PlanStart::Kind::kClass, 0, count});
  } else if (pattern.layer.has_value()) {
    consider({PlanStart::Kind::kLayer, 0, static_cast<double>(CountInLayer(*pattern.layer))});
  }
  if (pattern.has_name() && IsLiteral(pattern.source.name)) {
    consider({PlanStart::Kind::kName, 0, kNamesakes});
  }
  for (size_t i = 0; i < pattern.relations.size(); ++i) {
    const CompiledRelation& relation = pattern.relations[i];
    if (relation.negated) continue;
    const double others = EstimateMatches(*relation.other);
    if (others * kJoinCost >= best.cost) continue;
    const double cost =
        ChooseStart(*relation.other, std::nullopt).cost + kJoinCost * others * FanOut(relation);
    consider({PlanStart::Kind::kJoin, i, cost});
  }
  for (size_t i = 0; i < pattern.alternatives.size(); ++i) {
    if (pattern.alternatives[i].negated) continue;
    double cost = 0.0;
    for (const auto& one : pattern.alternatives[i].any_of) {
      cost += ChooseStart(*one, std::nullopt).cost;
    }
    consider({PlanStart::Kind::kUnion, i, cost});
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
      ids = Join(pattern, pattern.relations[start.part]);
      ids.erase(ids.begin(), std::upper_bound(ids.begin(), ids.end(), after));
      return ids;
    }
    case PlanStart::Kind::kUnion:
      return Unite(pattern.alternatives[start.part], after);
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
    matcher_->ForEachThatMayRelateTo(relation, pattern, *view_.FindNode(other),
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

std::vector<NodeId> Planner::Unite(const CompiledAlternatives& alternatives, NodeId after) {
  std::vector<NodeId> ids;
  for (const auto& one : alternatives.any_of) {
    const std::vector<NodeId> some =
        Candidates(*one, ChooseStart(*one, std::nullopt), std::nullopt, after);
    ids.insert(ids.end(), some.begin(), some.end());
    if (!matcher_->status().ok()) return {};
  }
  const auto in_count = static_cast<int64_t>(ids.size());
  SortUnique(&ids);
  AddStep("union", absl::StrCat(alternatives.any_of.size(), " alternatives"), in_count,
          static_cast<int64_t>(ids.size()));
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

// Below this many candidates it is cheaper to measure all of them than to walk the index of space.
constexpr double kMeasureAllMax = 64.0;

class Runner {
 public:
  Runner(const GraphView& view, const SearchQuestion& question, const StopCheck& stop)
      : view_(view),
        question_(question),
        pattern_(question.pattern.compiled()),
        matcher_(view, question.snapshot, question.at_ns, stop),
        planner_(view, &matcher_, question.explain ? &answer_.steps : nullptr) {}

  absl::StatusOr<SearchAnswer> Run() {
    const PlanStart start = planner_.ChooseStart(pattern_, question_.box_map);
    if (question_.near_map.has_value() && !pattern_.asks_for_agents && IsIndexBest(start)) {
      WalkNearest();
    } else if (question_.near_map.has_value()) {
      MeasureAll(start);
    } else {
      WalkIds(start);
    }
    DSG_RETURN_IF_ERROR(matcher_.status());
    DSG_RETURN_IF_ERROR(locate_status_);
    if (question_.count_only) return std::move(answer_);
    answer_.has_more = answer_.hits.size() > static_cast<size_t>(question_.limit);
    if (answer_.has_more) answer_.hits.pop_back();
    for (Hit& hit : answer_.hits) {
      hit.related = matcher_.Related(pattern_, *view_.FindNode(hit.key.id));
    }
    DSG_RETURN_IF_ERROR(matcher_.status());
    return std::move(answer_);
  }

 private:
  // The index of space narrows to a layer and a class by itself.
  static bool IsIndexBest(const PlanStart& start) {
    switch (start.kind) {
      case PlanStart::Kind::kClass:
      case PlanStart::Kind::kLayer:
      case PlanStart::Kind::kScan:
        return start.cost > kMeasureAllMax;
      default:
        return false;
    }
  }

  bool IsFull() const { return answer_.hits.size() > static_cast<size_t>(question_.limit); }

  void Add(Hit hit) {
    ++answer_.hit_count;
    if (!question_.count_only) answer_.hits.push_back(std::move(hit));
  }

  // The hit that a matching node is; nullopt where it lies outside of what is asked for.
  std::optional<Hit> Place(const ViewNode& node) {
    Hit hit;
    hit.key.id = node.id;
    const bool is_in_space = question_.near_map.has_value() || question_.box_map.has_value();
    ViewNode placed = node;
    if (IsAgentKind(view_.symbols().Text(node.kind))) {
      if (is_in_space && !pattern_.asks_for_agents) return std::nullopt;
      if (is_in_space || question_.at_ns.has_value()) {
        const absl::StatusOr<std::optional<LocatedPose>> located = question_.locate(node.id);
        if (!located.ok()) locate_status_ = located.status();
        if (!located.ok() || !located->has_value()) return std::nullopt;
        hit.is_in_gap = (*located)->quality == PoseQuality::kInGap;
        if (hit.is_in_gap) return is_in_space ? std::nullopt : std::optional(hit);
        hit.map_T_agent = placed.map_T_node = (*located)->map_T_agent;
      }
    }
    if (!is_in_space) return hit;
    if (question_.box_map.has_value() && !question_.box_map->intersects(placed.BoxMap())) {
      return std::nullopt;
    }
    if (!question_.near_map.has_value()) return hit;
    hit.key.distance_m = placed.DistanceTo(*question_.near_map);
    if (hit.key.distance_m > question_.distance_m_max) return std::nullopt;
    return hit;
  }

  void WalkIds(const PlanStart& start) {
    const NodeId after = question_.after.has_value() ? question_.after->id : NodeId();
    int64_t looked_at = 0;
    const auto look = [&](const ViewNode& node) {
      ++looked_at;
      if (matcher_.Matches(pattern_, node)) {
        if (std::optional<Hit> hit = Place(node)) Add(*std::move(hit));
      }
      return matcher_.status().ok() && locate_status_.ok() && !IsFull();
    };
    if (start.kind == PlanStart::Kind::kScan) {
      view_.ForEachNode(after, look);
      AddStep("scan", "", view_.node_count(), looked_at);
    } else {
      for (const NodeId id : planner_.Candidates(pattern_, start, question_.box_map, after)) {
        if (!look(*view_.FindNode(id))) break;
      }
    }
    AddStep("filter", Description(), looked_at, HitCount());
  }

  void MeasureAll(const PlanStart& start) {
    int64_t looked_at = 0;
    for (const NodeId id : planner_.Candidates(pattern_, start, question_.box_map, NodeId())) {
      const ViewNode& node = *view_.FindNode(id);
      ++looked_at;
      if (!matcher_.Matches(pattern_, node)) {
        if (!matcher_.status().ok()) return;
        continue;
      }
      std::optional<Hit> hit = Place(node);
      if (!locate_status_.ok()) return;
      if (hit.has_value() && IsAfter(hit->key)) Add(*std::move(hit));
    }
    AddStep("filter", Description(), looked_at, HitCount());
    if (question_.count_only) return;
    const auto by_key = [](const Hit& a, const Hit& b) { return a.key < b.key; };
    std::sort(answer_.hits.begin(), answer_.hits.end(), by_key);
    AddStep("order", "by distance, then id", HitCount(), HitCount());
    if (IsFull()) answer_.hits.resize(static_cast<size_t>(question_.limit) + 1);
  }

  void WalkNearest() {
    int64_t looked_at = 0;
    view_.ForEachNearest(
        *question_.near_map, SpaceFilterOf(pattern_), question_.distance_m_max,
        [&](const ViewNode& node, double distance_m) {
          ++looked_at;
          Hit hit;
          hit.key = {distance_m, node.id};
          if (IsAfter(hit.key) && Touches(node) && matcher_.Matches(pattern_, node)) {
            Add(std::move(hit));
          }
          return matcher_.Tick() && !IsFull();
        });
    const SpaceFilter filter = SpaceFilterOf(pattern_);
    AddStep("nearest", filter.class_name.has_value() ? pattern_.source.class_name : "",
            view_.node_count(), looked_at);
    AddStep("filter", Description(), looked_at, HitCount());
  }

  bool IsAfter(const HitKey& key) const {
    return !question_.after.has_value() || *question_.after < key;
  }
  bool Touches(const ViewNode& node) const {
    return !question_.box_map.has_value() || question_.box_map->intersects(node.BoxMap());
  }

  std::string Description() const {
    std::string text = question_.explain ? FormatQuery(pattern_.source) : "";
    if (question_.box_map.has_value()) text += ", touching the box";
    if (question_.at_ns.has_value()) absl::StrAppend(&text, ", at ", *question_.at_ns, " ns");
    return text;
  }
  int64_t HitCount() const {
    if (question_.count_only) return answer_.hit_count;
    return std::min(answer_.hit_count, static_cast<int64_t>(question_.limit) + 1);
  }
  void AddStep(const char* operation, std::string detail, int64_t in_count, int64_t out_count) {
    if (!question_.explain) return;
    answer_.steps.push_back({operation, std::move(detail), in_count, out_count});
  }

  const GraphView& view_;
  const SearchQuestion& question_;
  const CompiledPattern& pattern_;
  Matcher matcher_;
  SearchAnswer answer_;
  Planner planner_;
  absl::Status locate_status_;
};

}  // namespace

absl::StatusOr<SearchAnswer> RunSearch(const GraphView& view, const SearchQuestion& question,
                                       const StopCheck& stop) {
  return Runner(view, question, stop).Run();
}

absl::StatusOr<std::vector<NodeId>> FindMatches(const GraphView& view, const Pattern& pattern,
                                                const Snapshot* snapshot,
                                                std::optional<TimeNs> at_ns,
                                                const StopCheck& stop) {
  Matcher matcher(view, snapshot, at_ns, stop);
  std::vector<NodeId> ids = Planner(view, &matcher, nullptr).Collect(pattern.compiled());
  DSG_RETURN_IF_ERROR(matcher.status());
  return ids;
}

}  // namespace dsg::query
