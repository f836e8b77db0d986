// SPDX-License-Identifier: Apache-2.0
// Tracks as of a revision: which segments they are made of, and the stays along them.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "schema/base/cache.h"
#include "schema/store/snapshot.h"
#include "schema/store/sqlite/track_rows.h"

namespace dsg::sqlite {

/// One segment of a track, as a reader at the track's revision may see it.
struct SegmentRef {
  int64_t id = 0;
  Revision rev_from = 0;
  TimeNs t0 = 0;
  /// Of the last visible pose.
  TimeNs t1 = 0;
  /// Poses that the row must hold at least.
  int64_t pose_count = 0;
};

/// An agent's track as of one revision. Immutable.
struct Track {
  TrackInfo info;
  /// Ascending in time and in id.
  std::vector<SegmentRef> segments;
  /// Ascending by enter_ns; open ends are left open.
  std::vector<Stay> stays;
  /// Of each stay, the largest exit_ns of it and those before.
  std::vector<TimeNs> stays_end_ns;

  /// Index of the last segment with t0 <= t; -1 if none.
  int FindSegment(TimeNs t_ns) const;
  size_t memory_bytes() const {
    return sizeof(*this) + segments.capacity() * sizeof(SegmentRef) +
           stays.capacity() * (sizeof(Stay) + sizeof(TimeNs));
  }
};

using TrackPtr = std::shared_ptr<const Track>;
using NodeIdsPtr = std::shared_ptr<const std::vector<NodeId>>;

/// Reads a track as of `revision` in one read transaction.
/// Errors: NOT_FOUND/AGENT_UNKNOWN.
absl::StatusOr<TrackPtr> LoadTrack(Database& db, const MapSpec& spec, NodeId agent,
                                   Revision revision);

/// The newest revision in which the agent's node, poses or stays changed, at the head.
absl::StatusOr<Revision> LastChangeOfTrack(Database& db, NodeId agent);

/// Reads and checks one segment, whether it is current or was corrected since.
absl::StatusOr<SegmentPtr> LoadSegment(Database& db, const SegmentRef& segment);

struct TrackKey {
  NodeId agent;
  Revision revision;
  bool operator==(const TrackKey&) const = default;
  template <typename H>
  friend H AbslHashValue(H hash, const TrackKey& key) {
    return H::combine(std::move(hash), key.agent.value, key.revision);
  }
};
struct SegmentKey {
  int64_t id;
  Revision rev_from;
  int64_t pose_count;
  bool operator==(const SegmentKey&) const = default;
  template <typename H>
  friend H AbslHashValue(H hash, const SegmentKey& key) {
    return H::combine(std::move(hash), key.id, key.rev_from, key.pose_count);
  }
};

using TrackCache = Cache<TrackKey, TrackPtr>;
using SegmentCache = Cache<SegmentKey, SegmentPtr>;
using AncestorCache = Cache<TrackKey, NodeIdsPtr>;
/// Humans and robots at a revision; ascending.
using AgentCache = Cache<Revision, NodeIdsPtr>;

}  // namespace dsg::sqlite
