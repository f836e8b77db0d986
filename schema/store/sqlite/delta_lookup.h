// SPDX-License-Identifier: Apache-2.0
// What a commit asks of the graph at the head, answered from the writer's own connection.
#pragma once

#include "schema/store/commit_protocol.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

class DeltaLookup : public CommitSource {
 public:
  /// Both must outlive this.
  DeltaLookup(Database* db, const MapSpec* spec) : db_(*db), spec_(*spec) {}

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override;
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override;
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override;
  absl::StatusOr<bool> HasAsset(const Sha256& sha256) const override;
  const MapSpec* FindSpec() const override { return &spec_; }
  /// Cost: reads the begins and ends of all segments.
  absl::StatusOr<std::optional<Interval>> FindSpan() const override;

  const MapSpec& spec() const override { return spec_; }
  absl::StatusOr<SessionState> ReadSession(const std::string& session_id) const override;
  absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(const std::string& session_id,
                                                              int64_t sequence) const override;
  absl::StatusOr<std::optional<Node>> ReadNode(NodeId id) const override;
  absl::StatusOr<std::optional<Edge>> ReadEdge(const EdgeKey& key) const override;
  absl::StatusOr<std::vector<Layer>> ReadLayers() const override;

 private:
  absl::StatusOr<std::vector<NodeId>> ReadIds(const char* sql, NodeId id) const;

  Database& db_;
  const MapSpec& spec_;
};

}  // namespace dsg::sqlite
