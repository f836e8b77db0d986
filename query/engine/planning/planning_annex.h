// SPDX-License-Identifier: Apache-2.0
// What planning derives from a graph of places once and keeps beside it.
// Refuses to depend on the questions: it only saves their time.
#pragma once

#include <memory>

#include "query/engine/planning/landmarks.h"
#include "query/engine/planning/place_locator.h"
#include "query/engine/planning/room_graph.h"
#include "query/view/place_graph.h"

namespace dsg::query {

/// Threads: safe from many threads.
class PlanningAnnex final : public PlaceGraph::Annex {
 public:
  explicit PlanningAnnex(const PlaceGraph& graph) : rooms_(graph), locator_(graph) {}

  /// Of this graph, made at the first call.
  static PlanningAnnex& Of(const PlaceGraph& graph) {
    return static_cast<PlanningAnnex&>(
        graph.annex([&graph] { return std::make_unique<PlanningAnnex>(graph); }));
  }

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
