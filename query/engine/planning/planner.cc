// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/planner.h"

#include <algorithm>
#include <memory>
#include <tuple>

#include "query/engine/planning/landmarks.h"
#include "query/engine/planning/planning_annex.h"
#include "query/engine/planning/search_scratch.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Below the bound that is promised by more than rounding can add up to.
constexpr double kWeight = 1.0299;

std::vector<Anchor> Admitted(const PlaceGraph& graph, const Limits& limits,
                             const std::vector<Anchor>& anchors) {
  std::vector<Anchor> admitted;
  for (const Anchor& anchor : anchors) {
    if (limits.Admits(graph, anchor.place)) admitted.push_back(anchor);
  }
  return admitted;
}

// One question while it is being answered.
class Search {
 public:
  Search(const PlaceGraph& graph, const Limits& limits, const std::vector<Anchor>& from,
         const std::vector<Anchor>& to, const Guide& guide, double weight)
      : graph_(graph), limits_(limits), from_(from), to_(to), guide_(guide), weight_(weight) {}

  /// Only these rooms.
  void Confine(const RoomGraph* rooms, const std::vector<uint8_t>* open) {
    if (std::find(open->begin(), open->end(), uint8_t{0}) == open->end()) return;
    rooms_ = rooms;
    open_rooms_ = open;
  }

  absl::StatusOr<PlanResult> Run(const StopCheck& stop) {
    scratch_->Begin(graph_.size());
    for (size_t i = 0; i < to_.size(); ++i) {
      scratch_->at(to_[i].place).goal = static_cast<int32_t>(i);
    }
    for (const Anchor& anchor : from_) {
      if (IsOpen(anchor.place) && guide_.MayReach(anchor.place)) {
        Reach(anchor.place, anchor.way_m, -1);
      }
    }
    PlanResult result;
    while (!scratch_->empty()) {
      const SearchScratch::Entry entry = scratch_->Pop();
      if (entry.is_goal()) {
        result.route = RouteTo(entry.place());
        return result;
      }
      SearchScratch::Cell& cell = scratch_->at(entry.place());
      if (cell.settled) continue;
      cell.settled = true;
      if (result.expanded_count++ % kPlacesPerStop == 0 && stop) DSG_RETURN_IF_ERROR(stop());
      Expand(entry.place(), cell);
    }
    return result;
  }

 private:
  bool IsOpen(PlaceIndex place) const {
    return rooms_ == nullptr || (*open_rooms_)[static_cast<size_t>(rooms_->room_of(place))] != 0;
  }

  void Reach(PlaceIndex place, double way_m, PlaceIndex from) {
    SearchScratch::Cell& cell = scratch_->at(place);
    if (!cell.reached) cell.ahead_m = weight_ * guide_.AtLeast(place);
    cell.reached = true;
    cell.way_m = way_m;
    cell.from = from;
    scratch_->Push(way_m + cell.ahead_m, place, false);
  }

  void Expand(PlaceIndex place, const SearchScratch::Cell& cell) {
    if (cell.goal >= 0) {
      const double last_m = weight_ * to_[static_cast<size_t>(cell.goal)].way_m;
      scratch_->Push(cell.way_m + last_m, place, true);
    }
    for (const auto* link = graph_.links_begin(place); link != graph_.links_end(place); ++link) {
      const SearchScratch::Cell& next = scratch_->at(link->to);
      const double way_m = cell.way_m + link->length_m;
      if (next.settled || (next.reached && next.way_m <= way_m)) continue;
      if (!limits_.Admits(*link)) continue;
      if (!next.reached && !(limits_.Admits(graph_, link->to) && IsOpen(link->to))) continue;
      Reach(link->to, way_m, place);
    }
  }

  PlaceRoute RouteTo(PlaceIndex last) {
    PlaceRoute route;
    for (PlaceIndex place = last; place >= 0; place = scratch_->at(place).from) {
      route.places.push_back(place);
    }
    std::reverse(route.places.begin(), route.places.end());
    const auto first =
        std::lower_bound(from_.begin(), from_.end(), route.places.front(),
                         [](const Anchor& anchor, PlaceIndex at) { return anchor.place < at; });
    DSG_CHECK(first != from_.end() && first->place == route.places.front());
    route.from = *first;
    route.to = to_[static_cast<size_t>(scratch_->at(last).goal)];
    route.way_m = scratch_->at(last).way_m + route.to.way_m;
    return route;
  }

  const PlaceGraph& graph_;
  const Limits& limits_;
  const std::vector<Anchor>& from_;
  const std::vector<Anchor>& to_;
  const Guide& guide_;
  const double weight_;
  const RoomGraph* rooms_ = nullptr;
  const std::vector<uint8_t>* open_rooms_ = nullptr;
  BorrowedScratch scratch_;
};

}  // namespace

absl::StatusOr<PlanResult> PlanFlat(const PlaceGraph& graph, const Limits& limits,
                                    const std::vector<Anchor>& from, const std::vector<Anchor>& to,
                                    const StopCheck& stop) {
  const std::vector<Anchor> starts = Admitted(graph, limits, from);
  const std::vector<Anchor> goals = Admitted(graph, limits, to);
  if (starts.empty() || goals.empty()) return PlanResult();
  const Guide guide(graph, goals, nullptr);
  return Search(graph, limits, starts, goals, guide, 1.0).Run(stop);
}

absl::StatusOr<PlanResult> PlanHierarchical(const PlaceGraph& graph, const Limits& limits,
                                            const std::vector<Anchor>& from,
                                            const std::vector<Anchor>& to, const StopCheck& stop) {
  const std::vector<Anchor> starts = Admitted(graph, limits, from);
  const std::vector<Anchor> goals = Admitted(graph, limits, to);
  if (starts.empty() || goals.empty()) return PlanResult();
  DSG_ASSIGN_OR_RETURN(PlanningAnnex * annex, PlanningAnnex::Of(graph, stop));
  const std::vector<uint8_t> open = annex->rooms().LeadingTo(graph, goals, limits);
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Landmarks> landmarks,
                       annex->landmarks().Get(graph, limits, stop));
  const Guide guide(graph, goals, landmarks.get());
  Search search(graph, limits, starts, goals, guide, kWeight);
  search.Confine(&annex->rooms(), &open);
  return search.Run(stop);
}

}  // namespace dsg::query
