// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/search_run.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "query/engine/search/matcher.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Below this many candidates it is cheaper to measure all of them than to walk the index of space.
constexpr double kMeasureAllMax = 64.0;

class Runner {
 public:
  Runner(const GraphView& view, const SearchQuestion& question, const StopCheck& stop)
      : view_(view),
        question_(question),
        pattern_(question.pattern.compiled()),
        matcher_(view, question.at_ns, stop),
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

  void Add(Hit hit) { answer_.hits.push_back(std::move(hit)); }

  // The hit that a matching node is; nullopt where it lies outside of what is asked for.
  std::optional<Hit> Place(const ViewNode& node) {
    Hit hit;
    hit.key.id = node.id;
    if (!question_.near_map.has_value() && !question_.box_map.has_value()) return hit;
    ViewNode placed = node;
    if (IsAgentKind(view_.symbols().Text(node.kind))) {
      if (!pattern_.asks_for_agents) return std::nullopt;
      absl::StatusOr<std::optional<Pose3d>> located = question_.locate(node.id);
      if (!located.ok()) locate_status_ = located.status();
      if (!located.ok() || !located->has_value()) return std::nullopt;
      hit.map_T_agent = *located;
      placed.map_T_node = **located;
    }
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
    return std::min(static_cast<int64_t>(answer_.hits.size()),
                    static_cast<int64_t>(question_.limit) + 1);
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

bool Matches(const GraphView& view, const Pattern& pattern, const ViewNode& node,
             std::optional<TimeNs> at_ns) {
  return Matcher(view, at_ns, StopCheck()).Matches(pattern.compiled(), node);
}

absl::StatusOr<std::vector<NodeId>> FindMatches(const GraphView& view, const Pattern& pattern,
                                                std::optional<TimeNs> at_ns,
                                                const StopCheck& stop) {
  Matcher matcher(view, at_ns, stop);
  std::vector<NodeId> ids = Planner(view, &matcher, nullptr).Collect(pattern.compiled());
  DSG_RETURN_IF_ERROR(matcher.status());
  return ids;
}

}  // namespace dsg::query
