// SPDX-License-Identifier: Apache-2.0
// Rooms and places that a log's stays are derived from: the map's, and the log's own.
// Refuses to derive; StayTracker does.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/map_view.h"
#include "ingest/pipeline/layer_graph.h"
#include "ingest/presence/region_index.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class LogRegions {
 public:
  /// The map's, without those that `own` has numbered: an interrupted run of the same session has
  /// left them, and an undisturbed one would not know them yet.
  /// Errors: of the map.
  static absl::StatusOr<LogRegions> Read(const MapView& map,
                                         const std::optional<NodeNumbering>& own);

  /// The log's word on a node replaces the map's, as it will once it is committed; so a resumed
  /// run, which finds both the same, sees the same rooms.
  void Add(const GraphDelta& graph);

  /// The rooms and places that this log has found so far, instead of those it had found before.
  void SetFound(GraphDelta found) { found_ = std::move(found); }

  RegionIndex MakeIndex() const;

 private:
  std::vector<Node> rooms_;
  std::vector<Node> places_;
  std::vector<RegionIndex::Containment> contains_;
  GraphDelta found_;
};

}  // namespace dsg::ingest
