// SPDX-License-Identifier: Apache-2.0
// From tables to rows: current ones and those of the history in one order. Each row is read by who
// knows its columns and its checksum.
#include "schema/store/sqlite/stream_out.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/store/map_writer.h"
#include "schema/store/sqlite/batch_rows.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"
#include "schema/store/track_pieces.h"

namespace dsg::sqlite {
namespace {

#define DSG_NOW "9223372036854775807"

absl::StatusOr<NodeRow> NodeRowOf(const Query& query, const std::string& map) {
  const NodeRow row{IdOf(query.Int(0)), query.Int(1), static_cast<LayerId>(query.Int(2)),
                    query.Blob(3)};
  if (query.Int(4) == ChecksumOf(row)) return row;
  return CorruptRow(map, "node", ToString(row.id));
}

// A segment that the sweep over a track has reached.
struct ReachedSegment {
  std::vector<StoredPose> poses;
  size_t next = 0;
  PieceClock clock;
  /// A revision with a record, or kRevisionMax.
  Revision to = kRevisionMax;
};

class Streamer {
 public:
  Streamer(Database* db, const MapSpec& spec, const RowSink& sink, const StopCheck& stop)
      : db_(*db), spec_(spec), sink_(sink), stop_(stop) {}

  absl::Status Run() {
    DSG_RETURN_IF_ERROR(CheckNothingIsPending());
    DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(db_));
    DSG_RETURN_IF_ERROR(Show({row_kinds::kOldest, {readable.oldest}, {}}));
    DSG_RETURN_IF_ERROR(ShowNames());
    DSG_RETURN_IF_ERROR(ShowRevisions());
    DSG_RETURN_IF_ERROR(ShowSessionsAndTags());
    DSG_RETURN_IF_ERROR(ShowAssets());
    DSG_RETURN_IF_ERROR(
        ShowTable("SELECT key, rev_from, layer, payload, checksum, " DSG_NOW
                  " FROM node UNION ALL SELECT key, rev_from, layer, payload, checksum, rev_to"
                  " FROM node_history ORDER BY 1, 2",
                  NodeRowOf, 5));
    DSG_RETURN_IF_ERROR(
        ShowTable("SELECT source, relation, target, rev_from, weight, payload, checksum, " DSG_NOW
                  " FROM edge UNION ALL"
                  " SELECT source, relation, target, rev_from, weight, payload, checksum, rev_to"
                  " FROM edge_history ORDER BY 1, 2, 3, 4",
                  EdgeRowOf, 7));
    DSG_RETURN_IF_ERROR(
        ShowTable("SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum, " DSG_NOW
                  " FROM stay UNION ALL"
                  " SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum, rev_to"
                  " FROM stay_history ORDER BY 1, 2, 6",
                  StayRowOf, 7));
    DSG_RETURN_IF_ERROR(ShowTracks());
    DSG_RETURN_IF_ERROR(
        ShowBatches<FactorRow>("SELECT rev_from, id, 0 FROM factor_segment UNION ALL"
                               " SELECT rev_from, id, 1 FROM factor_history ORDER BY 1, 2",
                               {"SELECT agent, rev_from, t0, t1, payload, checksum, " DSG_NOW
                                " FROM factor_segment WHERE rev_from = ?1 AND id = ?2",
                                "SELECT agent, rev_from, t0, t1, payload, checksum, rev_to"
                                " FROM factor_history WHERE rev_from = ?1 AND id = ?2"}));
    DSG_RETURN_IF_ERROR(
        ShowBatches<ShapeRow>("SELECT rev_from, id, 0 FROM shape_segment UNION ALL"
                              " SELECT rev_from, id, 1 FROM shape_history ORDER BY 1, 2",
                              {"SELECT agent, rev_from, t0, t1, payload, checksum, " DSG_NOW
                               " FROM shape_segment WHERE rev_from = ?1 AND id = ?2",
                               "SELECT agent, rev_from, t0, t1, payload, checksum, rev_to"
                               " FROM shape_history WHERE rev_from = ?1 AND id = ?2"}));
    return ShowTable("SELECT x, y, z, rev_from, payload, checksum, " DSG_NOW
                     " FROM mesh_block UNION ALL"
                     " SELECT x, y, z, rev_from, payload, checksum, rev_to"
                     " FROM mesh_block_history ORDER BY 1, 2, 3, 4",
                     MeshRowOf, 6);
  }

 private:
  absl::Status CheckNothingIsPending() {
    DSG_ASSIGN_OR_RETURN(const auto left, GetPendingErasure(db_));
    if (!left.has_value()) return absl::OkStatus();
    // Only bytes that no row has any more may be left to wipe.
    if (left->node_count + left->edge_count + left->mesh_block_count + left->span_count == 0) {
      return absl::OkStatus();
    }
    return ErasurePendingError(spec_.name);
  }

  absl::Status Show(const StreamRow& row) {
    DSG_RETURN_IF_ERROR(AskStop(stop_));
    return sink_(row);
  }

  // `rev_to` is the column behind those that `read` reads.
  template <typename Read>
  absl::Status ShowTable(const char* sql, const Read& read, int rev_to) {
    Query query(db_, sql);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const auto row, read(query, spec_.name));
      DSG_RETURN_IF_ERROR(Show(StreamRowOf(row, query.Int(rev_to))));
    }
    return query.status();
  }

  // In the order in which they were written; payloads are not sorted.
  template <typename Row>
  absl::Status ShowBatches(const char* sql, const std::array<const char*, 2>& select) {
    Query refs(db_, sql);
    while (refs.Next()) {
      Query query(db_, select[refs.Int(2) != 0 ? 1 : 0]);
      if (!query.Bind(refs.Int(0), refs.Int(1)).Next()) return query.status();
      DSG_ASSIGN_OR_RETURN(const Row row, BatchRowOf<Row>(query, spec_.name));
      DSG_RETURN_IF_ERROR(Show(StreamRowOf(row, query.Int(6))));
    }
    return refs.status();
  }

  absl::Status ShowNames() {
    Query layers(db_, "SELECT id, rank, rev_from, name FROM layer ORDER BY id");
    while (layers.Next()) {
      DSG_RETURN_IF_ERROR(Show({row_kinds::kLayer,
                                {layers.Int(0), layers.Int(1), layers.Int(2)},
                                {std::string(layers.Text(3))}}));
    }
    DSG_RETURN_IF_ERROR(layers.status());
    Query labels(db_, "SELECT id, rev_from, name FROM label ORDER BY id, rev_from");
    while (labels.Next()) {
      DSG_RETURN_IF_ERROR(
          Show({row_kinds::kLabel, {labels.Int(0), labels.Int(1)}, {std::string(labels.Text(2))}}));
    }
    DSG_RETURN_IF_ERROR(labels.status());
    Query relations(db_, "SELECT id, name FROM relation ORDER BY id");
    while (relations.Next()) {
      DSG_RETURN_IF_ERROR(
          Show({row_kinds::kRelation, {relations.Int(0)}, {std::string(relations.Text(1))}}));
    }
    return relations.status();
  }

  absl::Status ShowRevisions() {
    Query query(db_, "SELECT " DSG_REVISION_COLUMNS
                     ", parent_digest, delta_checksum FROM revision ORDER BY revision");
    while (query.Next()) {
      StreamedRevision revision;
      DSG_ASSIGN_OR_RETURN(revision.record, HeadFromRow(query, spec_.name));
      const Revision number = revision.record.info.revision;
      const bool is_after_gap = number != (records_.empty() ? 0 : records_.back()) + 1;
      if (is_after_gap) revision.parent = ParentFromRow(query);
      if (is_after_gap && !revision.parent.has_value()) {
        return CorruptRow(spec_.name, "revision", absl::StrCat(number));
      }
      if (!query.IsNull(19)) revision.delta_checksum = query.Int(19);
      DSG_ASSIGN_OR_RETURN(revision.touched, ReadTouched(number));
      records_.push_back(number);
      DSG_RETURN_IF_ERROR(Show(RowOfRevision(revision)));
    }
    return query.status();
  }

  absl::StatusOr<std::optional<TouchedKeys>> ReadTouched(Revision revision) {
    Query query(db_, "SELECT revision, payload, checksum FROM touched WHERE revision = ?1");
    const bool found = query.Bind(revision).Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (!found) return std::optional<TouchedKeys>();
    TouchedKeys keys;
    DSG_RETURN_IF_ERROR(TouchedFromRow(query, spec_.name, &keys));
    return std::optional<TouchedKeys>(std::move(keys));
  }

  absl::Status ShowSessionsAndTags() {
    Query sessions(db_,
                   "SELECT session_id, last_sequence, last_revision, first_revision,"
                   " last_checksum FROM session ORDER BY session_id");
    while (sessions.Next()) {
      DSG_RETURN_IF_ERROR(Show({row_kinds::kSession,
                                {sessions.Int(1), sessions.Int(2), sessions.Int(3),
                                 sessions.IsNull(4) ? 0 : 1, sessions.Int(4)},
                                {std::string(sessions.Text(0))}}));
    }
    DSG_RETURN_IF_ERROR(sessions.status());
    DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, ReadTags(db_));
    for (const Tag& tag : tags) {
      DSG_RETURN_IF_ERROR(
          Show({row_kinds::kTag, {tag.revision, tag.created_ns}, {tag.name, tag.note}}));
    }
    return absl::OkStatus();
  }

  absl::Status ShowAssets() {
    Query query(db_,
                "SELECT sha256, part, rev_from, media_type, checksum, payload FROM asset"
                " ORDER BY sha256, part");
    while (query.Next()) {
      const int64_t part = query.Int(1);
      if (query.Int(4) != Checksum(query.Blob(5), static_cast<uint64_t>(part))) {
        return CorruptRow(spec_.name, "asset", absl::StrCat(part));
      }
      if (part == 0) {
        DSG_RETURN_IF_ERROR(Show({row_kinds::kAsset,
                                  {query.Int(2)},
                                  {std::string(query.Blob(0)), std::string(query.Text(3))}}));
      }
      DSG_RETURN_IF_ERROR(Show({row_kinds::kAssetPart, {part}, {std::string(query.Blob(5))}}));
    }
    DSG_RETURN_IF_ERROR(query.status());
    Query dropped(db_, "SELECT rev_from, sha256 FROM dropped_asset ORDER BY rev_from, sha256");
    while (dropped.Next()) {
      DSG_RETURN_IF_ERROR(
          Show({row_kinds::kDroppedAsset, {dropped.Int(0)}, {std::string(dropped.Blob(1))}}));
    }
    return dropped.status();
  }

  absl::Status ShowTracks() {
    Query tracks(db_, "SELECT slot, agent FROM track ORDER BY agent");
    while (tracks.Next()) {
      DSG_RETURN_IF_ERROR(ShowTrack(tracks.Int(0), IdOf(tracks.Int(1))));
    }
    return tracks.status();
  }

  struct SegmentRef {
    TimeNs t0 = 0;
    int64_t id = 0;
    Revision rev_from = 0;
    Revision rev_to = kRevisionMax;
  };

  absl::StatusOr<std::vector<SegmentRef>> ReadRefs(int64_t slot) {
    std::vector<SegmentRef> refs;
    Query query(db_, "SELECT t0, id, rev_from, " DSG_NOW
                     " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 UNION ALL"
                     " SELECT t0, id, rev_from, rev_to"
                     " FROM trajectory_history WHERE id BETWEEN ?1 AND ?2");
    query.Bind(FirstSegmentId(slot), LastSegmentId(slot));
    while (query.Next()) {
      refs.push_back({query.Int(0), query.Int(1), query.Int(2), query.Int(3)});
    }
    DSG_RETURN_IF_ERROR(query.status());
    std::sort(refs.begin(), refs.end(), [](const SegmentRef& a, const SegmentRef& b) {
      return std::make_pair(a.t0, a.rev_from) < std::make_pair(b.t0, b.rev_from);
    });
    return refs;
  }

  absl::StatusOr<std::vector<StoredPose>> ReadSegment(const SegmentRef& ref) {
    Query query(db_, ref.rev_to == kRevisionMax
                         ? "SELECT " DSG_SEGMENT_COLUMNS
                           " FROM trajectory_segment WHERE id = ?1 AND rev_from = ?2"
                         : "SELECT " DSG_SEGMENT_COLUMNS
                           " FROM trajectory_history WHERE id = ?1 AND rev_from = ?2");
    const bool found = query.Bind(ref.id, ref.rev_from).Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (!found) return CorruptRow(spec_.name, "trajectory_segment", absl::StrCat(ref.id));
    DSG_ASSIGN_OR_RETURN(SegmentRow row, SegmentRowOf(query, spec_.name));
    return std::move(row.poses);
  }

  // The poses of all segments of a track, by time and then by revision.
  absl::Status ShowTrack(int64_t slot, NodeId agent) {
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackMark> marks, ReadMarks(db_, slot));
    std::vector<TrackEnd> at_marks;
    for (const TrackMark& mark : marks) {
      at_marks.push_back({mark.revision, mark.last_ns, mark.pose_count});
    }
    const std::vector<TrackEnd> ends = EndsAtRecords(at_marks, records_);
    TrackStreamer streamer(&spec_, agent, &ends, &sink_);
    DSG_RETURN_IF_ERROR(streamer.ShowEnds());
    DSG_ASSIGN_OR_RETURN(const std::vector<SegmentRef> refs, ReadRefs(slot));
    Reached reached;
    for (auto ref = refs.begin(); ref != refs.end() || !reached.empty();) {
      const bool is_due =
          ref != refs.end() && (reached.empty() || ref->t0 <= reached.begin()->first.first);
      if (is_due) {
        DSG_RETURN_IF_ERROR(AskStop(stop_));
        DSG_ASSIGN_OR_RETURN(std::vector<StoredPose> poses, ReadSegment(*ref));
        // Marks between records may be compacted away; at a record they tell what it shows.
        ReachedSegment segment{std::move(poses), 0,
                               PieceClock(&ends, FirstFrom(records_, ref->rev_from)),
                               FirstFrom(records_, ref->rev_to)};
        DSG_RETURN_IF_ERROR(Reach(agent, std::move(segment), &reached));
        ++ref;
        continue;
      }
      const auto first = reached.begin();
      ReachedSegment segment = std::move(first->second);
      const Revision from = first->first.second;
      reached.erase(first);
      DSG_RETURN_IF_ERROR(streamer.Add({from, segment.to, segment.poses[segment.next]}));
      ++segment.next;
      DSG_RETURN_IF_ERROR(Reach(agent, std::move(segment), &reached));
    }
    return streamer.Finish();
  }

  /// By time and revision of their next pose.
  using Reached = std::multimap<std::pair<TimeNs, Revision>, ReachedSegment>;

  absl::Status Reach(NodeId agent, ReachedSegment segment, Reached* reached) {
    if (segment.next == segment.poses.size()) return absl::OkStatus();
    const TimeNs time_ns = segment.poses[segment.next].time_ns;
    const Revision came = segment.clock.At(time_ns);
    if (came == kRevisionMax) {
      // Of what compaction has left of an ended segment nothing is shown beyond the marks.
      if (segment.to != kRevisionMax) return absl::OkStatus();
      return CorruptRow(spec_.name, "track_mark", ToString(agent));
    }
    reached->emplace(std::make_pair(time_ns, came), std::move(segment));
    return absl::OkStatus();
  }

  Database& db_;
  const MapSpec& spec_;
  const RowSink& sink_;
  const StopCheck& stop_;
  /// Revisions with a record.
  std::vector<Revision> records_;
};

#undef DSG_NOW

}  // namespace

absl::Status StreamRows(Database& db, const MapSpec& spec, const RowSink& sink,
                        const StopCheck& stop) {
  const ReadTransaction transaction(&db);
  DSG_RETURN_IF_ERROR(transaction.status());
  return Streamer(&db, spec, sink, stop).Run();
}

}  // namespace dsg::sqlite
