// SPDX-License-Identifier: Apache-2.0
// What CheckDelta asks of the graph, answered from the writer's own connection.
#pragma once

#include "schema/model/delta_check.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

class DeltaLookup : public GraphLookup {
 public:
  explicit DeltaLookup(Database* db) : db_(*db) {}

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override;
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override;
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override;
  absl::StatusOr<bool> HasAsset(const Sha256& sha256) const override;

 private:
  absl::StatusOr<std::vector<NodeId>> ReadIds(const char* sql, NodeId id) const;

  Database& db_;
};

}  // namespace dsg::sqlite
