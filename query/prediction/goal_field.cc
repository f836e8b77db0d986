// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "query/prediction/prediction.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

/// Links between two questions to the stop check.
constexpr int64_t kStopPeriod = 4096;

bool IsPlace(int place, const WalkGraph& graph) {
  return place >= 0 && static_cast<size_t>(place) < graph.places_map.size();
}

void CheckGraph(const WalkGraph& graph) {
  DSG_CHECK(graph.clearance_m.size() == graph.places_map.size());
  DSG_CHECK(graph.link_clearance_m.empty() || graph.link_clearance_m.size() == graph.links.size());
  for (const Eigen::Vector3d& place_map : graph.places_map) DSG_CHECK(place_map.allFinite());
  for (const double clearance_m : graph.clearance_m) {
    DSG_CHECK(clearance_m >= 0.0 && std::isfinite(clearance_m));
  }
  for (const double clearance_m : graph.link_clearance_m) DSG_CHECK(clearance_m >= 0.0);
  for (const auto& [a, b] : graph.links) DSG_CHECK(IsPlace(a, graph) && IsPlace(b, graph));
}

void CheckGoals(const std::vector<Goal>& goals, const WalkGraph& graph) {
  for (const Goal& goal : goals) {
    DSG_CHECK(IsPlace(goal.place, graph));
    DSG_CHECK(goal.prior >= 0.0 && std::isfinite(goal.prior));
  }
}

}  // namespace

absl::StatusOr<GoalField> GoalField::Make(WalkGraph graph, std::vector<Goal> goals,
                                          const StopCheck& stop) {
  CheckGraph(graph);
  CheckGoals(goals, graph);
  DSG_ASSIGN_OR_RETURN(FreeSpace free_space, FreeSpace::Make(graph, stop));
  DSG_ASSIGN_OR_RETURN(WalkIndex index, WalkIndex::Make(graph, stop));
  const auto ground = std::make_shared<Ground>(
      Ground{std::move(graph), std::move(free_space), std::move(index), {}, {}});
  const std::vector<Eigen::Vector3d>& places_map = ground->graph.places_map;
  std::vector<size_t>& offsets = ground->offsets;
  offsets.assign(places_map.size() + 1, 0);
  for (const auto& [a, b] : ground->graph.links) {
    ++offsets[a + 1];
    ++offsets[b + 1];
  }
  for (size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  ground->neighbours.resize(offsets.back());
  std::vector<size_t> next(offsets.begin(), offsets.end() - 1);
  StopCounter counter(stop, kStopPeriod);
  for (const auto& [a, b] : ground->graph.links) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const double way_m = (places_map[a] - places_map[b]).norm();
    ground->neighbours[next[a]++] = {b, way_m};
    ground->neighbours[next[b]++] = {a, way_m};
  }
  GoalField field;
  field.ground_ = ground;
  field.goals_ = std::move(goals);
  return field;
}

GoalField::GoalField(WalkGraph graph, std::vector<Goal> goals)
    : GoalField(*Make(std::move(graph), std::move(goals), StopCheck())) {}

GoalField GoalField::WithGoals(std::vector<Goal> goals) const {
  CheckGoals(goals, graph());
  GoalField field;
  field.ground_ = ground_;
  field.goals_ = std::move(goals);
  return field;
}

size_t GoalField::memory_bytes() const {
  const WalkGraph& walk = graph();
  return sizeof(Ground) + goals_.capacity() * sizeof(Goal) + free_space().memory_bytes() +
         index().memory_bytes() + walk.places_map.capacity() * sizeof(Eigen::Vector3d) +
         (walk.clearance_m.capacity() + walk.link_clearance_m.capacity()) * sizeof(double) +
         walk.links.capacity() * sizeof(std::pair<int, int>) +
         ground_->offsets.capacity() * sizeof(size_t) +
         ground_->neighbours.capacity() * sizeof(Neighbour);
}

}  // namespace dsg::query
