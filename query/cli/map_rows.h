// SPDX-License-Identifier: Apache-2.0
// Reads a map from a store or a server piece by piece, all at one revision, for files that may be
// larger than the memory.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/session.h"
#include "schema/base/time.h"
#include "schema/model/revision.h"

namespace dsg::v1 {
class Edge;
class Node;
class PresenceInterval;
class TimedPose;
}  // namespace dsg::v1

namespace dsg::cli {

/// An agent of a map.
struct AgentRow {
  std::string id;
  std::string name;
  std::string kind;
  /// Poses further apart than this are a gap.
  TimeNs gap_ns_max = 0;
};

/// Every call hands out its rows as they come; an error that `take` returns ends it.
///
/// Errors: of the calls of the api.
class MapRows {
 public:
  template <class Row>
  using Take = std::function<absl::Status(const Row& row)>;

  /// Settles the revision. `at_ns`: only what was there at this instant, and tracks and stays up to
  /// it; unset = everything of the revision, ended or not. Requires: the session's map is chosen.
  static absl::StatusOr<MapRows> Open(Session* session, std::optional<TimeNs> at_ns);

  Revision revision() const { return revision_; }
  std::optional<TimeNs> at_ns() const { return at_ns_; }
  const Session& session() const { return session_; }

  /// All fields; ascending by id. Agents are at their last positions, or at those of the instant.
  absl::Status Nodes(const Take<v1::Node>& take) const;
  /// Ascending by source, relation, target.
  absl::Status Edges(const Take<v1::Edge>& take) const;
  /// Ascending by id.
  absl::StatusOr<std::vector<AgentRow>> Agents() const;
  /// Ascending in time.
  absl::Status Poses(const std::string& agent_id, const Take<v1::TimedPose>& take) const;
  /// Of a room or a place, ascending by time and agent.
  absl::Status Stays(const std::string& node_id, const Take<v1::PresenceInterval>& take) const;

 private:
  MapRows(Session* session, Revision revision, std::optional<TimeNs> at_ns)
      : session_(*session), revision_(revision), at_ns_(at_ns) {}

  template <class Request>
  Request Begin() const;
  /// The half-open end of what is read of tracks and stays.
  TimeNs EndNs() const;

  Session& session_;
  Revision revision_;
  std::optional<TimeNs> at_ns_;
};

}  // namespace dsg::cli
