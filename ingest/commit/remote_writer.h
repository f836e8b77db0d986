// SPDX-License-Identifier: Apache-2.0
// A map on a dsg-server, and a GraphWriter that commits to it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/client/credentials.h"
#include "query/client/retry.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"
#include "schema/model/revision.h"
#include "schema/store/graph_writer.h"
#include "schema/store/snapshot.h"

namespace dsg::ingest {

/// A map on a server, as far as ingest needs it.
class RemoteMap {
 public:
  virtual ~RemoteMap() = default;
  /// Idempotent by session and sequence, so what was not answered is sent again, see
  /// RemoteOptions. One delta is under way at a time: whoever makes them waits, and no more than
  /// that one is held in memory however long the link is down.
  virtual GraphWriter& writer() = 0;
  virtual const MapSpec& spec() const = 0;
  /// Rooms and places, for deriving stays.
  virtual absl::StatusOr<std::vector<Node>> ListNodes(const std::string& layer) = 0;
  /// Targets of CONTAINS edges from `parent`.
  virtual absl::StatusOr<std::vector<NodeId>> ListChildren(NodeId parent) = 0;
  /// Existing agents (humans and robots), for naming.
  virtual absl::StatusOr<std::vector<Node>> ListAgents() = 0;
  /// nullopt for an unknown agent, and for one without poses. `at`: as believed then; unset = now.
  virtual absl::StatusOr<std::optional<TrackInfo>> FindTrack(NodeId agent,
                                                             std::optional<Revision> at) = 0;
  /// Stored poses with from_ns <= time < to_ns, ascending; for comparing a log that overlaps.
  virtual absl::StatusOr<std::vector<TimedPose>> ReadPoses(NodeId agent, TimeNs from_ns,
                                                           TimeNs to_ns) = 0;
  /// Newest first, below `before` (0 = from the newest), at most `limit`; without digests and
  /// counts.
  virtual absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) = 0;
  /// Whether opening has made the map.
  virtual bool is_new() const = 0;
  /// Drops the map if it is still the one that was opened, at revision `head`. Nothing may be
  /// called afterwards.
  ///
  /// Errors: ABORTED/PARENT_REVISION_STALE or MAP_REPLACED; NOT_FOUND/MAP_UNKNOWN; UNIMPLEMENTED by
  /// servers that are older than the call.
  virtual absl::Status Drop(Revision head) = 0;
};

struct RemoteOptions {
  /// How long a call is repeated while the server cannot be reached or is overloaded.
  TimeNs retry_ns_max = 600 * kNsPerSecond;
  /// Gets a sentence when a server does not answer, every few seconds while it does not, and when
  /// it does again. May be empty.
  client::TellWait tell;
  /// How the server knows who calls.
  client::Credentials credentials;
};

/// Opens a map on the server at `address` ("unix:PATH" or "HOST:PORT"), creating it from `spec`
/// if it is missing.
///
/// Errors: UNAVAILABLE naming the address when the server cannot be reached in time; else what
/// the server says, with its reason and metadata.
absl::StatusOr<std::unique_ptr<RemoteMap>> OpenRemoteMap(const std::string& address,
                                                         const MapSpec& spec,
                                                         const RemoteOptions& options = {});

}  // namespace dsg::ingest
