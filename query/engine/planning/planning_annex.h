// SPDX-License-Identifier: Apache-2.0
// What planning derives from a graph of places once and keeps beside it.
// Refuses to depend on the questions: it only saves their time.
#pragma once

#include <utility>

#include "absl/status/statusor.h"
#include "query/engine/planning/landmarks.h"
#include "query/engine/planning/place_locator.h"
#include "query/engine/planning/room_graph.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Threads: safe from many threads.
class PlanningAnnex final : public PlaceGraph::Annex {
 public:
  PlanningAnnex(RoomGraph rooms, PlaceLocator locator)
      : rooms_(std::move(rooms)), locator_(std::move(locator)) {}

  /// Of this graph, made at the first call; lives as long as the graph.
  /// Errors: what `stop` returned.
  static absl::StatusOr<PlanningAnnex*> Of(const PlaceGraph& graph, const StopCheck& stop);

  const RoomGraph& rooms() const { return rooms_; }
  const PlaceLocator& locator() const { return locator_; }
  LandmarkCache& landmarks() { return landmarks_; }

  size_t memory_bytes() const override {
    return rooms_.memory_bytes() + locator_.memory_bytes() + landmarks_.memory_bytes();
  }

 private:
  RoomGraph rooms_;
  PlaceLocator locator_;
  LandmarkCache landmarks_;
};

}  // namespace dsg::query
