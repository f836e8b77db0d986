// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/planning_annex.h"

#include <memory>

#include "schema/base/status.h"

namespace dsg::query {

absl::StatusOr<PlanningAnnex*> PlanningAnnex::Of(const PlaceGraph& graph, const StopCheck& stop) {
  const auto make = [&]() -> absl::StatusOr<std::unique_ptr<PlaceGraph::Annex>> {
    DSG_ASSIGN_OR_RETURN(RoomGraph rooms, RoomGraph::Build(graph, stop));
    DSG_ASSIGN_OR_RETURN(PlaceLocator locator, PlaceLocator::Build(graph, stop));
    return std::make_unique<PlanningAnnex>(std::move(rooms), std::move(locator));
  };
  DSG_ASSIGN_OR_RETURN(PlaceGraph::Annex * annex, graph.annex(stop, make));
  // Planning is the only one that makes any.
  return static_cast<PlanningAnnex*>(annex);
}

}  // namespace dsg::query
