// SPDX-License-Identifier: Apache-2.0
// Rows of tracks: slots and marks of agents, segments and their boxes, and the stays along them.
// The one place that knows their columns.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/codec/trajectory_codec.h"
#include "schema/model/graph_delta.h"
#include "schema/store/content_rows.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// The number of an agent's track in this map; 0 if it has none.
absl::StatusOr<int64_t> FindSlot(Database& db, NodeId agent);
/// Requires: the agent has none. Errors: RESOURCE_EXHAUSTED/LIMIT_EXCEEDED.
absl::StatusOr<int64_t> AddSlot(Database& db, NodeId agent);

/// How far a track reaches from a revision on, until its next mark.
struct TrackMark {
  Revision revision = 0;
  /// Of the last pose; kTimeMin if there is none.
  TimeNs last_ns = kTimeMin;
  int64_t pose_count = 0;
};
/// Columns: revision, last_ns, pose_count.
TrackMark MarkFromRow(const Query& query);
/// The mark that holds at `revision`; nullopt before the first.
absl::StatusOr<std::optional<TrackMark>> FindMark(Database& db, int64_t slot, Revision revision);
/// The newest mark of an agent; nullopt if it has no track.
absl::StatusOr<std::optional<TrackMark>> FindLastMark(Database& db, NodeId agent);
/// The latest end of a track in any of the revisions since `revision`; kTimeMin if none is marked.
absl::StatusOr<TimeNs> FurthestMark(Database& db, int64_t slot, Revision revision);
/// Order: by revision.
absl::StatusOr<std::vector<TrackMark>> ReadMarks(Database& db, int64_t slot);
/// Replaces the mark of that revision, if there is one.
absl::Status WriteMark(Database& db, int64_t slot, const TrackMark& mark);

using SegmentPtr = std::shared_ptr<const SegmentReader>;

/// A row of trajectory_segment or trajectory_history.
struct SegmentRow {
  int64_t id = 0;
  Revision rev_from = 0;
  std::vector<StoredPose> poses;
  size_t payload_bytes = 0;
};
#define DSG_SEGMENT_COLUMNS "id, rev_from, t0, t1, pose_count, checksum, payload"
/// Columns: DSG_SEGMENT_COLUMNS. Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<SegmentPtr> SegmentReaderOf(const Query& query, const std::string& map);
absl::StatusOr<SegmentRow> SegmentRowOf(const Query& query, const std::string& map);

/// The last current segment with an id in [first_id, last_id].
absl::StatusOr<std::optional<SegmentRow>> FindLastSegment(Database& db, int64_t first_id,
                                                          int64_t last_id);
/// A current segment. Requires of all: `poses` has some.
absl::Status InsertSegment(Database& db, int64_t id, Revision rev_from,
                           const SegmentEncoder& poses);
/// The same segment with more poses.
absl::Status UpdateSegment(Database& db, int64_t id, Revision rev_from,
                           const SegmentEncoder& poses);
absl::Status InsertPastSegment(Database& db, int64_t id, Revision rev_from, Revision rev_to,
                               const SegmentEncoder& poses);
/// Moves a current segment to the history and drops its box.
absl::Status EndSegment(Database& db, int64_t id, Revision revision);

/// Bounds of a segment's poses and of the way from the pose before.
struct SegmentBox {
  Box3d box_map;
  TimeNs t0 = 0;
  TimeNs t1 = 0;
};
/// Without t1. Rounded outward, as all boxes in rows. Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<SegmentBox> ReadSegmentBox(Database& db, const MapSpec& spec, int64_t id);
/// Replaces the box of that segment, if there is one.
absl::Status WriteSegmentBox(Database& db, const MapSpec& spec, int64_t id, const SegmentBox& box);
/// Makes the box cover a pose before it too.
absl::Status ExtendSegmentBox(Database& db, const MapSpec& spec, int64_t id,
                              const StoredPose& before);

/// Columns: agent, enter_ns, exit_ns, place, room, rev_from, checksum.
/// Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<StayRow> StayRowOf(const Query& query, const std::string& map);

/// Stays in a room or place that may touch [from_ns, to_ns), as of a revision: of those whose end
/// is open, the caller knows more.
absl::StatusOr<std::vector<Stay>> ReadStaysIn(Database& db, NodeId room_or_place, TimeNs from_ns,
                                              TimeNs to_ns, Revision revision);

absl::Status WriteStays(const std::vector<Stay>& stays, CommitContext* commit);
absl::Status EndStays(const std::vector<StayKey>& keys, CommitContext* commit);
absl::Status EndStaysOf(NodeId agent, CommitContext* commit);

}  // namespace dsg::sqlite
