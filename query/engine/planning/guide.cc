// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/guide.h"

#include <algorithm>
#include <limits>

namespace dsg::query {
namespace {

// So few goals are each bounded for themselves; more cost more than they save.
constexpr size_t kSingleGoalsMax = 4;

}  // namespace

Guide::Guide(const PlaceGraph& graph, const std::vector<Anchor>& goals, const Landmarks* landmarks)
    : graph_(graph), landmarks_(landmarks) {
  std::vector<const Anchor*> sorted;
  for (const Anchor& goal : goals) sorted.push_back(&goal);
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Anchor* a, const Anchor* b) {
    return ComponentOf(a->place) < ComponentOf(b->place);
  });
  for (const Anchor* goal : sorted) {
    const int32_t component = ComponentOf(goal->place);
    const bool is_new =
        goals.size() <= kSingleGoalsMax || groups_.empty() || groups_.back().component != component;
    if (is_new) {
      Group& group = groups_.emplace_back();
      group.component = component;
      group.way_m = goal->way_m;
      if (landmarks_ != nullptr) group.low = group.high = landmarks_->of(goal->place);
    }
    Extend(*goal, &groups_.back());
  }
}

void Guide::Extend(const Anchor& goal, Group* group) const {
  group->box.extend(graph_.position_map(goal.place));
  group->way_m = std::min(group->way_m, goal.way_m);
  if (landmarks_ == nullptr) return;
  const Landmarks::Distances& known = landmarks_->of(goal.place);
  for (size_t i = 0; i < known.size(); ++i) {
    group->low[i] = std::min(group->low[i], known[i]);
    group->high[i] = std::max(group->high[i], known[i]);
  }
}

bool Guide::MayReach(PlaceIndex place) const {
  if (landmarks_ == nullptr) return true;
  const int32_t component = landmarks_->component(place);
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return group.component == component; });
}

double Guide::StraightFrom(PlaceIndex place, const Group& group) const {
  return group.box.exteriorDistance(graph_.position_map(place));
}

double Guide::AtLeast(PlaceIndex place) const {
  double nearest_m = std::numeric_limits<double>::infinity();
  if (landmarks_ == nullptr) {
    for (const Group& group : groups_) {
      nearest_m = std::min(nearest_m, StraightFrom(place, group) + group.way_m);
    }
    return nearest_m;
  }
  const int32_t component = landmarks_->component(place);
  const Landmarks::Distances& known = landmarks_->of(place);
  for (const Group& group : groups_) {
    if (group.component != component) continue;
    float bound_m = 0.0F;
    for (size_t i = 0; i < known.size(); ++i) {
      bound_m = std::max({bound_m, group.low[i] - known[i], known[i] - group.high[i]});
    }
    const double around_m = static_cast<double>(bound_m) - landmarks_->slack_m();
    nearest_m = std::min(nearest_m, std::max(around_m, StraightFrom(place, group)) + group.way_m);
  }
  return nearest_m;
}

}  // namespace dsg::query
