// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {
namespace {

// Tracks kept open between commits; beyond, all are reloaded when needed.
constexpr size_t kOpenTracksMax = 2000;

struct SegmentRow {
  int64_t id = 0;
  Revision rev_from = 0;
  std::vector<StoredPose> poses;
};

absl::StatusOr<SegmentRow> DecodeSegmentRow(Query& query, const MapSpec& spec) {
  SegmentRow row;
  row.id = query.Int(0);
  row.rev_from = query.Int(1);
  const std::string payload(query.Blob(6));
  const auto checksum =
      RowChecksum({row.id, row.rev_from, query.Int(2), query.Int(3), query.Int(4)}, payload);
  const auto reader = checksum == query.Int(5) ? SegmentReader::Parse(payload) : nullptr;
  if (reader == nullptr || !reader->DecodeAll(&row.poses)) {
    return CorruptRow(spec.name, "trajectory_segment", absl::StrCat(row.id));
  }
  return row;
}

constexpr char kSelectLast[] =
    "SELECT id, rev_from, t0, t1, pose_count, checksum, payload FROM trajectory_segment"
    " WHERE id BETWEEN ?1 AND ?2 ORDER BY id DESC LIMIT 1";

void Grow(const StoredPose& pose, TrajectoryCodec codec, Box3d* box) {
  box->extend(PositionOf(pose, codec));
}

}  // namespace

/// The open end of a track.
struct TrackWriter::Tail {
  NodeId agent;
  int64_t slot = 0;
  int64_t pose_count = 0;
  /// The last pose of the track, if there is one.
  std::optional<StoredPose> last;
  SegmentEncoder encoder{TrajectoryCodec::kQuantized};
  /// Row of the segment in `encoder`; 0 until it has one.
  int64_t segment_id = 0;
  bool segment_stored = false;
  Revision segment_rev_from = 0;
  int64_t previous_segment_id = 0;
  /// Bounds of the segment's poses and of the way from the pose before.
  Box3d box;
  TimeNs box_t0 = 0;
};

TrackWriter::TrackWriter() = default;
TrackWriter::~TrackWriter() = default;

void TrackWriter::Forget() { tails_.clear(); }

absl::StatusOr<TrackWriter::Tail*> TrackWriter::LoadTail(NodeId agent, CommitContext* commit) {
  const auto found = tails_.find(agent);
  if (found != tails_.end()) return found->second.get();
  if (tails_.size() >= kOpenTracksMax) tails_.clear();
  auto made = std::make_unique<Tail>();
  Tail& tail = *made;
  tail.agent = agent;
  tail.encoder = SegmentEncoder(commit->spec.codec);
  bool known = false;
  {
    Query query(commit->db, "SELECT slot FROM track WHERE agent = ?1");
    known = query.Bind(KeyOf(agent)).Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (known) tail.slot = query.Int(0);
  }
  if (known) {
    Query query(commit->db,
                "SELECT pose_count FROM track_mark WHERE slot = ?1 ORDER BY revision DESC LIMIT 1");
    if (query.Bind(tail.slot).Next()) tail.pose_count = query.Int(0);
    DSG_RETURN_IF_ERROR(query.status());
    DSG_RETURN_IF_ERROR(LoadOpenSegment(&tail, commit));
  } else {
    DSG_ASSIGN_OR_RETURN(const int64_t last_slot,
                         commit->db.QueryInt("SELECT coalesce(max(slot), 0) FROM track"));
    tail.slot = last_slot + 1;
    if (tail.slot >= int64_t{1} << (63 - kSegmentTimeBits)) {
      return MakeError(Reason::kLimitExceeded, "a map holds at most two million tracks",
                       {{"map", commit->spec.name}});
    }
    DSG_RETURN_IF_ERROR(Query(commit->db, "INSERT INTO track (slot, agent) VALUES (?1, ?2)")
                            .Bind(tail.slot, KeyOf(agent))
                            .Run());
  }
  return (tails_[agent] = std::move(made)).get();
}

absl::Status TrackWriter::LoadOpenSegment(Tail* tail, CommitContext* commit) {
  Query query(commit->db, kSelectLast);
  const bool found = query.Bind(FirstSegmentId(tail->slot), LastSegmentId(tail->slot)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const SegmentRow row, DecodeSegmentRow(query, commit->spec));
  tail->segment_id = row.id;
  tail->segment_stored = true;
  tail->segment_rev_from = row.rev_from;
  tail->box_t0 = row.poses.front().time_ns;
  tail->last = row.poses.back();
  for (const StoredPose& pose : row.poses) {
    // What fitted once fits again: the encoder is deterministic.
    if (!tail->encoder.Add(pose)) {
      return CorruptRow(commit->spec.name, "trajectory_segment", absl::StrCat(row.id));
    }
  }
  Query box(commit->db, "SELECT x0, x1, y0, y1, z0, z1, t0 FROM segment_box WHERE id = ?1");
  if (!box.Bind(row.id).Next()) {
    DSG_RETURN_IF_ERROR(box.status());
    return CorruptRow(commit->spec.name, "segment_box", absl::StrCat(row.id));
  }
  const auto metres = [&](int column) { return static_cast<double>(box.Int(column)) / 1000.0; };
  tail->box.extend(Eigen::Vector3d(metres(0), metres(2), metres(4)));
  tail->box.extend(Eigen::Vector3d(metres(1), metres(3), metres(5)));
  tail->box_t0 = std::min(tail->box_t0, commit->spec.epoch_ns + box.Int(6) * (kNsPerSecond / 10));
  return absl::OkStatus();
}

absl::Status TrackWriter::AppendPose(const StoredPose& pose, Tail* tail, CommitContext* commit) {
  const bool gap =
      tail->last.has_value() && pose.time_ns - tail->last->time_ns > commit->spec.gap_ns_max;
  if (gap || tail->encoder.empty() || !tail->encoder.Add(pose)) {
    if (!tail->encoder.empty()) DSG_RETURN_IF_ERROR(WriteSegment(tail, commit));
    tail->previous_segment_id = tail->segment_id;
    tail->encoder = SegmentEncoder(commit->spec.codec);
    tail->encoder.Add(pose);
    // Readers order segments by id; the time in it only makes seeks short.
    tail->segment_id =
        std::max(SegmentId(tail->slot, pose.time_ns, commit->spec), tail->previous_segment_id + 1);
    tail->segment_stored = false;
    tail->segment_rev_from = commit->revision();
    tail->box.setEmpty();
    tail->box_t0 = pose.time_ns;
    // Also across what is a gap here: an agent may have a longer limit of its own.
    if (tail->last.has_value()) {
      Grow(*tail->last, commit->spec.codec, &tail->box);
      tail->box_t0 = tail->last->time_ns;
    }
  }
  Grow(pose, commit->spec.codec, &tail->box);
  tail->last = pose;
  ++tail->pose_count;
  return absl::OkStatus();
}

absl::Status TrackWriter::WriteSegment(Tail* tail, CommitContext* commit) {
  const std::string payload = tail->encoder.Encode();
  const TimeNs t0 = tail->encoder.poses().front().time_ns;
  const TimeNs t1 = tail->encoder.poses().back().time_ns;
  const auto count = static_cast<int64_t>(tail->encoder.poses().size());
  const int64_t checksum =
      RowChecksum({tail->segment_id, tail->segment_rev_from, t0, t1, count}, payload);
  DSG_ASSIGN_OR_RETURN(const int64_t from_tenths, ToTenthsFloor(tail->box_t0, commit->spec));
  DSG_ASSIGN_OR_RETURN(const int64_t to_tenths, ToTenthsCeil(t1, commit->spec));
  if (tail->segment_stored) {
    DSG_RETURN_IF_ERROR(Query(commit->db,
                              "UPDATE trajectory_segment SET t1 = ?2, pose_count = ?3,"
                              " checksum = ?4, payload = ?5 WHERE id = ?1")
                            .Bind(tail->segment_id, t1, count, checksum, Query::BlobView{payload})
                            .Run());
  } else {
    DSG_RETURN_IF_ERROR(Query(commit->db,
                              "INSERT INTO trajectory_segment"
                              " (id, rev_from, t0, t1, pose_count, checksum, payload)"
                              " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
                            .Bind(tail->segment_id, tail->segment_rev_from, t0, t1, count, checksum,
                                  Query::BlobView{payload})
                            .Run());
  }
  tail->segment_stored = true;
  const IntBox box = ToMillimetres(tail->box);
  return Query(commit->db,
               "INSERT OR REPLACE INTO segment_box"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)")
      .Bind(tail->segment_id, box.x0, box.x1, box.y0, box.y1, box.z0, box.z1, from_tenths,
            to_tenths)
      .Run();
}

absl::Status TrackWriter::WriteMark(const Tail& tail, CommitContext* commit) {
  commit->touched.tracks.push_back(tail.agent);
  // An emptied track ends before all time.
  const TimeNs last_ns = tail.last.has_value() ? tail.last->time_ns : kTimeMin;
  return Query(commit->db,
               "INSERT OR REPLACE INTO track_mark (slot, revision, last_ns, pose_count)"
               " VALUES (?1, ?2, ?3, ?4)")
      .Bind(tail.slot, commit->revision(), last_ns, tail.pose_count)
      .Run();
}

absl::Status TrackWriter::Append(const TrajectoryAppend& append, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(Tail* const tail, LoadTail(append.agent, commit));
  std::string scratch;
  for (const TimedPose& pose : append.poses) {
    const StoredPose stored = ToStored(pose, commit->spec.codec);
    commit->head.content.Add(PoseIdentity(append.agent, stored, commit->spec.codec, &scratch));
    DSG_RETURN_IF_ERROR(AppendPose(stored, tail, commit));
  }
  DSG_RETURN_IF_ERROR(WriteSegment(tail, commit));
  commit->head.info.pose_count += static_cast<int64_t>(append.poses.size());
  const TimeNs first_ns = append.poses.front().time_ns;
  const TimeNs last_ns = append.poses.back().time_ns;
  Head& head = commit->head;
  head.first_pose_ns = std::min(head.first_pose_ns.value_or(first_ns), first_ns);
  head.last_pose_ns = std::max(head.last_pose_ns.value_or(last_ns), last_ns);
  return WriteMark(*tail, commit);
}

// Moves all segments that end at or after `from_ns` to the history and hands out their poses.
absl::Status TrackWriter::TakeSegmentsFrom(TimeNs from_ns, Tail* tail,
                                           std::vector<StoredPose>* poses, CommitContext* commit) {
  std::vector<SegmentRow> rows;
  {
    Query query(commit->db,
                "SELECT id, rev_from, t0, t1, pose_count, checksum, payload"
                " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 AND t1 >= ?3 ORDER BY id");
    query.Bind(FirstSegmentId(tail->slot), LastSegmentId(tail->slot), from_ns);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(SegmentRow row, DecodeSegmentRow(query, commit->spec));
      rows.push_back(std::move(row));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (SegmentRow& row : rows) {
    // A row of this very revision was never visible, so history need not know it.
    DSG_RETURN_IF_ERROR(Query(commit->db,
                              "INSERT INTO trajectory_history"
                              " SELECT id, rev_from, ?2, t0, t1, pose_count, checksum, payload"
                              " FROM trajectory_segment WHERE id = ?1 AND rev_from < ?2")
                            .Bind(row.id, commit->revision())
                            .Run());
    DSG_RETURN_IF_ERROR(
        Query(commit->db, "DELETE FROM trajectory_segment WHERE id = ?1").Bind(row.id).Run());
    DSG_RETURN_IF_ERROR(
        Query(commit->db, "DELETE FROM segment_box WHERE id = ?1").Bind(row.id).Run());
    tail->pose_count -= static_cast<int64_t>(row.poses.size());
    poses->insert(poses->end(), std::make_move_iterator(row.poses.begin()),
                  std::make_move_iterator(row.poses.end()));
  }
  return absl::OkStatus();
}

// Rewrites the track from the first corrected segment to its end: what lies outside of the
// correction is kept, and links between segments and their boxes stay right without special cases.
absl::Status TrackWriter::Correct(const TrajectoryCorrection& correction, CommitContext* commit) {
  tails_.erase(correction.agent);
  const TrajectoryCodec codec = commit->spec.codec;
  DSG_ASSIGN_OR_RETURN(const Tail* const loaded, LoadTail(correction.agent, commit));
  Tail tail;
  tail.agent = correction.agent;
  tail.slot = loaded->slot;
  tail.pose_count = loaded->pose_count;
  tail.encoder = SegmentEncoder(codec);
  tails_.erase(correction.agent);
  std::vector<StoredPose> poses;
  DSG_RETURN_IF_ERROR(TakeSegmentsFrom(correction.from_ns, &tail, &poses, commit));
  std::string scratch;
  std::erase_if(poses, [&](const StoredPose& pose) {
    const bool replaced = correction.from_ns <= pose.time_ns && pose.time_ns < correction.to_ns;
    if (replaced) {
      commit->head.content.Remove(PoseIdentity(correction.agent, pose, codec, &scratch));
      --commit->head.info.pose_count;
    }
    return replaced;
  });
  for (const TimedPose& pose : correction.poses) {
    poses.push_back(ToStored(pose, codec));
    commit->head.content.Add(PoseIdentity(correction.agent, poses.back(), codec, &scratch));
    ++commit->head.info.pose_count;
  }
  std::sort(poses.begin(), poses.end(),
            [](const StoredPose& a, const StoredPose& b) { return a.time_ns < b.time_ns; });
  DSG_RETURN_IF_ERROR(LoadOpenSegment(&tail, commit));
  // The segment before stays as it is: begin a new one.
  tail.encoder = SegmentEncoder(codec);
  for (const StoredPose& pose : poses) DSG_RETURN_IF_ERROR(AppendPose(pose, &tail, commit));
  if (!tail.encoder.empty()) DSG_RETURN_IF_ERROR(WriteSegment(&tail, commit));
  DSG_RETURN_IF_ERROR(WriteMark(tail, commit));
  Query span(commit->db, "SELECT min(t0), max(t1) FROM trajectory_segment");
  const bool any = span.Next() && !span.IsNull(0);
  DSG_RETURN_IF_ERROR(span.status());
  commit->head.first_pose_ns = any ? std::optional<TimeNs>(span.Int(0)) : std::nullopt;
  commit->head.last_pose_ns = any ? std::optional<TimeNs>(span.Int(1)) : std::nullopt;
  return absl::OkStatus();
}

absl::Status TrackWriter::End(NodeId agent, CommitContext* commit) {
  Query known(commit->db, "SELECT 1 FROM track WHERE agent = ?1");
  const bool has_track = known.Bind(KeyOf(agent)).Next();
  DSG_RETURN_IF_ERROR(known.status());
  if (!has_track) return absl::OkStatus();
  return Correct({agent, kTimeMin, kTimeMax, {}}, commit);
}

}  // namespace dsg::sqlite
