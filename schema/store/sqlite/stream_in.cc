// SPDX-License-Identifier: Apache-2.0
// From rows to tables, and to what SQLite keeps of its own: cells, boxes, marks, ids of segments.
#include "schema/store/sqlite/stream_in.h"

#include <algorithm>
#include <bit>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"
#include "schema/store/track_pieces.h"

namespace dsg::sqlite {
namespace {

// After so many bytes of rows the log is copied back, so that it does not become a second map.
constexpr size_t kStepBytes = size_t{32} << 20;

absl::StatusOr<int64_t> FindOrAddSlot(Database& db, NodeId agent) {
  DSG_ASSIGN_OR_RETURN(const int64_t slot, FindSlot(db, agent));
  return slot != 0 ? slot : AddSlot(db, agent);
}

// One track whose pieces come in the order of their times.
class TrackCollector {
 public:
  TrackCollector(Database* db, const MapSpec& spec, NodeId agent)
      : db_(*db), spec_(spec), agent_(agent) {}

  NodeId agent() const { return agent_; }

  absl::Status TakeEnd(const StreamRow& row) {
    const TrackEnd end{row.numbers[1], row.numbers[2], row.numbers[3]};
    if (!ends_.empty() && end.revision <= ends_.back().revision) {
      return BadRowError(spec_.name, row, "is out of order");
    }
    ends_.push_back(end);
    return absl::OkStatus();
  }

  absl::Status TakePiece(const StreamRow& row) {
    DSG_RETURN_IF_ERROR(FindSlotOnce());
    DSG_ASSIGN_OR_RETURN(const std::vector<StoredPose> poses, PosesOfPiece(spec_, row));
    SegmentEncoder encoder(spec_.codec);
    for (const StoredPose& pose : poses) {
      if (!encoder.Add(pose)) return BadRowError(spec_.name, row, "is too large");
    }
    const Piece piece{poses.front().time_ns, row.numbers[1], row.rev_to(), poses.back().time_ns,
                      PositionOf(poses.back(), spec_.codec)};
    const bool is_sound = piece.from < piece.to &&
                          (pieces_.empty() || pieces_.back().t0 < piece.t0 ||
                           (pieces_.back().t0 == piece.t0 && pieces_.back().to <= piece.from));
    if (!is_sound) return BadRowError(spec_.name, row, "is out of order");
    // Ids order the segments of a revision; of one time only one is shown.
    if (pieces_.empty() || pieces_.back().t0 < piece.t0) {
      id_ = std::max(SegmentId(slot_, piece.t0, spec_), id_ + 1);
    }
    touched_.insert(piece.from);
    if (piece.to == kRevisionMax) {
      DSG_RETURN_IF_ERROR(InsertSegment(db_, id_, piece.from, encoder));
      DSG_RETURN_IF_ERROR(WriteSegmentBox(db_, spec_, id_, BoxOf(poses, piece)));
    } else {
      touched_.insert(piece.to);
      DSG_RETURN_IF_ERROR(InsertPastSegment(db_, id_, piece.from, piece.to, encoder));
    }
    pieces_.push_back(piece);
    return absl::OkStatus();
  }

  // Marks of all revisions in which poses came or went, and of those whose lists name the track.
  absl::Status Finish() {
    if (slot_ == 0) return absl::OkStatus();
    for (const TrackEnd& end : ends_) touched_.insert(end.revision);
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackMark> listed, ReadMarks(db_, slot_));
    for (const TrackMark& mark : listed) touched_.insert(mark.revision);
    TrackEnd reached;
    auto next = ends_.begin();
    for (const Revision revision : touched_) {
      for (; next != ends_.end() && next->revision <= revision; ++next) reached = *next;
      DSG_RETURN_IF_ERROR(WriteMark(db_, slot_, {revision, reached.last_ns, reached.pose_count}));
    }
    return absl::OkStatus();
  }

 private:
  struct Piece {
    TimeNs t0 = 0;
    Revision from = 0;
    Revision to = 0;
    TimeNs t1 = 0;
    Eigen::Vector3d last_map;
  };

  absl::Status FindSlotOnce() {
    if (slot_ != 0) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(slot_, FindOrAddSlot(db_, agent_));
    id_ = FirstSegmentId(slot_);
    return absl::OkStatus();
  }

  // Covers the way from the pose before too, whichever that is in any revision that shows both.
  SegmentBox BoxOf(const std::vector<StoredPose>& poses, const Piece& piece) const {
    SegmentBox box;
    box.t0 = piece.t0;
    box.t1 = piece.t1;
    for (const StoredPose& pose : poses) box.box_map.extend(PositionOf(pose, spec_.codec));
    // Revisions of which the piece before is not known yet.
    std::vector<std::pair<Revision, Revision>> open = {{piece.from, kRevisionMax}};
    for (auto before = pieces_.rbegin(); before != pieces_.rend() && !open.empty(); ++before) {
      std::vector<std::pair<Revision, Revision>> left;
      for (const auto& [from, to] : open) {
        if (before->to <= from || to <= before->from) {
          left.emplace_back(from, to);
          continue;
        }
        box.box_map.extend(before->last_map);
        box.t0 = std::min(box.t0, before->t1);
        if (from < before->from) left.emplace_back(from, before->from);
        if (before->to < to) left.emplace_back(before->to, to);
      }
      open = std::move(left);
    }
    return box;
  }

  Database& db_;
  const MapSpec& spec_;
  const NodeId agent_;
  int64_t slot_ = 0;
  /// Of the last segment.
  int64_t id_ = 0;
  std::vector<TrackEnd> ends_;
  /// In the order of their times.
  std::vector<Piece> pieces_;
  std::set<Revision> touched_;
};

class Collector {
 public:
  Collector(Database* db, const MapSpec& spec) : db_(*db), spec_(spec) {}

  absl::Status Take(const StreamRow& row) {
    const bool is_of_track = row.kind == row_kinds::kTrackEnd || row.kind == row_kinds::kPoses;
    const NodeId agent = is_of_track ? IdOf(row.numbers[0]) : NodeId();
    if (track_.has_value() && track_->agent() != agent) DSG_RETURN_IF_ERROR(FinishTrack());
    if (is_of_track && !track_.has_value()) track_.emplace(&db_, spec_, agent);
    if (row.kind == row_kinds::kTrackEnd) return track_->TakeEnd(row);
    if (row.kind == row_kinds::kPoses) return track_->TakePiece(row);
    return TakeRow(row);
  }

  absl::Status FinishTrack() {
    if (track_.has_value()) DSG_RETURN_IF_ERROR(track_->Finish());
    track_.reset();
    return absl::OkStatus();
  }

 private:
  absl::Status TakeRow(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    const std::vector<std::string>& t = row.texts;
    switch (row.kind) {
      case row_kinds::kOldest:
        DSG_RETURN_IF_ERROR(Run("UPDATE map SET oldest_revision = ?1", n[0]));
        // Those of a new map; the stream has all.
        return db_.Execute("DELETE FROM layer");
      case row_kinds::kLayer:
        return Run("INSERT INTO layer (id, rank, rev_from, name) VALUES (?1, ?2, ?3, ?4)", n[0],
                   n[1], n[2], t[0]);
      case row_kinds::kLabel:
        return Run("INSERT INTO label (id, rev_from, name) VALUES (?1, ?2, ?3)", n[0], n[1], t[0]);
      case row_kinds::kRelation:
        return Run("INSERT INTO relation (id, name) VALUES (?1, ?2)", n[0], t[0]);
      case row_kinds::kRevision:
        return TakeRevision(row);
      case row_kinds::kSession:
        return Run(
            "INSERT INTO session"
            " (session_id, last_sequence, last_revision, first_revision, last_checksum)"
            " VALUES (?1, ?2, ?3, ?4, ?5)",
            t[0], n[0], n[1], n[2], n[3] != 0 ? std::optional<int64_t>(n[4]) : std::nullopt);
      case row_kinds::kTag:
        return Run("INSERT INTO tag (name, revision, created_ns, note) VALUES (?1, ?2, ?3, ?4)",
                   t[0], n[0], n[1], t[1]);
      case row_kinds::kAsset:
        asset_ = row;
        return absl::OkStatus();
      case row_kinds::kAssetPart:
        return TakePart(row);
      case row_kinds::kDroppedAsset:
        return Run("INSERT INTO dropped_asset (rev_from, sha256) VALUES (?1, ?2)", n[0],
                   Query::BlobView{t[0]});
      case row_kinds::kNode:
        return TakeNode(row);
      case row_kinds::kEdge:
        return TakeEdge(row);
      case row_kinds::kStay:
        return TakeStay(row);
      case row_kinds::kFactors:
        return TakeBatch<FactorRow>(
            row,
            "INSERT INTO factor_segment (id, agent, rev_from, t0, t1, checksum, payload)"
            " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            "INSERT INTO factor_history (id, agent, rev_from, t0, t1, checksum, payload, rev_to)"
            " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)");
      case row_kinds::kShapes:
        return TakeBatch<ShapeRow>(
            row,
            "INSERT INTO shape_segment (id, agent, rev_from, t0, t1, checksum, payload)"
            " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            "INSERT INTO shape_history (id, agent, rev_from, t0, t1, checksum, payload, rev_to)"
            " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)");
      default:
        return TakeMeshBlock(row);
    }
  }

  template <typename... Values>
  absl::Status Run(const char* sql, const Values&... values) {
    return Query(db_, sql).Bind(values...).Run();
  }

  // Into the table of current rows, or that of past ones, which has rev_to as its last value.
  template <typename... Values>
  absl::Status Insert(const StreamRow& row, const char* current, const char* past,
                      const Values&... values) {
    if (row.rev_to() == kRevisionMax) return Run(current, values...);
    return Run(past, values..., row.rev_to());
  }

  absl::Status TakeRevision(const StreamRow& row) {
    DSG_ASSIGN_OR_RETURN(StreamedRevision revision, RevisionOfRow(spec_.name, row));
    DSG_RETURN_IF_ERROR(
        InsertRecord(db_, revision.record, revision.delta_checksum, revision.parent));
    if (!revision.touched.has_value()) return absl::OkStatus();
    const Revision number = revision.record.info.revision;
    DSG_RETURN_IF_ERROR(InsertTouched(db_, number, &*revision.touched));
    // How far they reach is known when their poses come.
    for (const NodeId agent : revision.touched->tracks) {
      DSG_ASSIGN_OR_RETURN(const int64_t slot, FindOrAddSlot(db_, agent));
      DSG_RETURN_IF_ERROR(WriteMark(db_, slot, {number}));
    }
    return absl::OkStatus();
  }

  absl::Status TakePart(const StreamRow& row) {
    if (asset_.texts.empty()) return BadRowError(spec_.name, row, "is a part of no asset");
    return Run(
        "INSERT INTO asset (sha256, part, rev_from, media_type, checksum, payload)"
        " VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
        Query::BlobView{asset_.texts[0]}, row.numbers[0], asset_.numbers[0], asset_.texts[1],
        Checksum(row.texts[0], static_cast<uint64_t>(row.numbers[0])),
        Query::BlobView{row.texts[0]});
  }

  absl::Status TakeNode(const StreamRow& row) {
    DSG_ASSIGN_OR_RETURN(const Node node, NodeOfRow(spec_.name, row));
    const NodeRow stored{node.id, node.revision, node.layer, row.texts[0]};
    DSG_RETURN_IF_ERROR(
        Insert(row,
               "INSERT INTO node (key, rev_from, layer, name, payload, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
               "INSERT INTO node_history (key, rev_from, layer, name, payload, checksum, rev_to)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
               KeyOf(node.id), node.revision, node.layer, node.name,
               Query::BlobView{stored.payload}, ChecksumOf(stored)));
    return row.rev_to() == kRevisionMax ? AddCell(db_, node) : absl::OkStatus();
  }

  absl::Status TakeEdge(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    const EdgeRow stored{IdOf(n[0]),  n[1], IdOf(n[2]), n[3], std::bit_cast<double>(n[4]),
                         row.texts[0]};
    return Insert(row,
                  "INSERT INTO edge (source, relation, target, rev_from, weight, payload, checksum)"
                  " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                  "INSERT INTO edge_history"
                  " (source, relation, target, rev_from, weight, payload, checksum, rev_to)"
                  " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                  n[0], n[1], n[2], n[3], stored.weight, Query::BlobView{stored.payload},
                  ChecksumOf(stored));
  }

  absl::Status TakeStay(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    const StayRow stored{IdOf(n[0]), n[1], n[2], IdOf(n[3]), IdOf(n[4]), n[5]};
    return Insert(
        row,
        "INSERT INTO stay (agent, enter_ns, exit_ns, place, room, rev_from, checksum)"
        " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        "INSERT INTO stay_history (agent, enter_ns, exit_ns, place, room, rev_from, checksum,"
        " rev_to) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
        n[0], n[1], n[2], n[3], n[4], n[5], ChecksumOf(stored));
  }

  template <typename Row>
  absl::Status TakeBatch(const StreamRow& row, const char* current, const char* past) {
    const std::vector<int64_t>& n = row.numbers;
    const Row stored{{IdOf(n[0]), n[1], n[2], n[3], row.texts[0]}};
    return Insert(row, current, past, ++last_batch_, n[0], n[1], n[2], n[3], ChecksumOf(stored),
                  Query::BlobView{stored.payload});
  }

  absl::Status TakeMeshBlock(const StreamRow& row) {
    const std::vector<int64_t>& n = row.numbers;
    const MeshRow stored{
        {static_cast<int32_t>(n[0]), static_cast<int32_t>(n[1]), static_cast<int32_t>(n[2])},
        n[3],
        row.texts[0]};
    return Insert(row,
                  "INSERT INTO mesh_block (x, y, z, rev_from, payload, checksum)"
                  " VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                  "INSERT INTO mesh_block_history (x, y, z, rev_from, payload, checksum, rev_to)"
                  " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                  n[0], n[1], n[2], n[3], Query::BlobView{stored.payload}, ChecksumOf(stored));
  }

  Database& db_;
  const MapSpec& spec_;
  std::optional<TrackCollector> track_;
  /// Whose parts come.
  StreamRow asset_;
  int64_t last_batch_ = 0;
};

size_t RowBytes(const StreamRow& row) {
  size_t bytes = 8 * row.numbers.size();
  for (const std::string& text : row.texts) bytes += text.size();
  return bytes;
}

}  // namespace

absl::Status CollectRows(Database& db, const MapSpec& spec, const RowSource& rows,
                         const StopCheck& stop) {
  Collector collector(&db, spec);
  StreamRow row;
  size_t bytes = 0;
  DSG_RETURN_IF_ERROR(db.Execute("BEGIN IMMEDIATE"));
  for (;;) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const bool has_row, rows(&row));
    if (!has_row) break;
    const absl::Status taken = collector.Take(row);
    // Such as a key that was there already.
    if (absl::IsInternal(taken)) return BadRowError(spec.name, row, std::string(taken.message()));
    DSG_RETURN_IF_ERROR(taken);
    bytes += RowBytes(row);
    if (bytes < kStepBytes) continue;
    bytes = 0;
    DSG_RETURN_IF_ERROR(db.Execute("COMMIT"));
    db.Checkpoint(/*truncate=*/false);
    DSG_RETURN_IF_ERROR(db.Execute("BEGIN IMMEDIATE"));
  }
  DSG_RETURN_IF_ERROR(collector.FinishTrack());
  return db.Execute("COMMIT");
}

}  // namespace dsg::sqlite
