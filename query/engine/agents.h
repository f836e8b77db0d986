// SPDX-License-Identifier: Apache-2.0
// Agents: which one a text names, where they were at an instant, and what stood above them then.
// The .cc file answers LocateAgent, BatchLocateAgents, GetTrajectory and ListFactors.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/cache.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
enum PoseQuality : int;
}  // namespace dsg::v1

namespace google::protobuf {
template <typename Element>
class RepeatedPtrField;
}  // namespace google::protobuf

namespace dsg::query {

v1::PoseQuality QualityToProto(PoseQuality quality);

/// The agent that a text names, kept per opened map and revision: a look-up in the store costs
/// several times as much as finding where the agent was.
///
/// Threads: safe from many threads.
class AgentNames {
 public:
  /// As Snapshot::ResolveAgent. Only names that exist are remembered, so callers cannot fill the
  /// memory with invented ones. Errors: AGENT_UNKNOWN; FIELD_INVALID for an empty text.
  absl::StatusOr<NodeId> Resolve(const Snapshot& snapshot, const std::string& id_or_name);

 private:
  struct Key {
    uint64_t opening = 0;
    Revision revision = 0;
    std::string id_or_name;
    bool operator==(const Key&) const = default;
    template <typename H>
    friend H AbslHashValue(H hash, const Key& key) {
      return H::combine(std::move(hash), key.opening, key.revision, key.id_or_name);
    }
  };

  // Entries.
  Cache<Key, NodeId> entries_{65'536};
};

/// The tracks of the agents that a request names, of all if it names none. Ascending id, each once.
/// Errors: AGENT_UNKNOWN; FIELD_INVALID for more than kBatchSizeMax names; of the store.
absl::StatusOr<std::vector<TrackInfo>> TracksOf(
    AgentNames* names, const Snapshot& snapshot,
    const google::protobuf::RepeatedPtrField<std::string>& agents, const StopCheck& stop);

/// Where an agent was; nullopt before its first pose and after its last. In a gap of its track
/// (PoseQuality::kInGap) it was there, and nobody knows where.
/// Errors: of the store.
absl::StatusOr<std::optional<LocatedPose>> LocateAt(const Snapshot& snapshot, NodeId agent,
                                                    TimeNs at_ns);

/// An agent at one instant; its node alone knows only where it was last.
struct AgentAt {
  /// Posed as its track has it then.
  Node node;
  /// Its track has a gap then: where it was nobody knows, and the pose means nothing.
  bool is_in_gap = false;
};

/// Agents that match `filter`, which names an instant between their first pose and their last. Of a
/// box only those that are known to have been in it.
/// Order: ascending id.
/// Cost: a look at each track that matches; there are hundreds of agents rather than millions.
/// Errors: of the store; what `stop` returned.
absl::StatusOr<std::vector<AgentAt>> AgentsAt(const Snapshot& snapshot, NodeFilter filter,
                                              const StopCheck& stop);

struct Ancestry {
  /// Nearest first.
  std::vector<std::string> ids;
  /// The first of kind building; empty when there is none.
  std::string building_id;
};

/// What stands above a place or room, in the form of replies, kept per opened map and revision:
/// questions about the past ask for the same few places again and again.
///
/// Threads: safe from many threads.
class AncestryCache {
 public:
  /// All that stands above the place of a stay, or above its room when it names no place. When the
  /// hierarchy does not put the place below the room of the stay, the stay is believed: the room
  /// and all above it.
  absl::StatusOr<std::shared_ptr<const Ancestry>> Find(const Snapshot& snapshot, const Stay& stay);

 private:
  struct Key {
    uint64_t opening = 0;
    Revision revision = 0;
    NodeId place;
    NodeId room;
    bool operator==(const Key&) const = default;
    template <typename H>
    friend H AbslHashValue(H hash, const Key& key) {
      return H::combine(std::move(hash), key.opening, key.revision, key.place.value,
                        key.room.value);
    }
  };

  // Entries, about 20 MB; a building has some thousand places, of which one revision is asked at a
  // time.
  Cache<Key, std::shared_ptr<const Ancestry>> entries_{65'536};
};

}  // namespace dsg::query
