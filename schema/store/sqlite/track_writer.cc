// SPDX-License-Identifier: Apache-2.0
// Tracks that grow at their ends. Corrections: track_correction.cc.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/track_writer_internal.h"

namespace dsg::sqlite {
namespace {

// Tracks kept open between commits; beyond, all are reloaded when needed.
constexpr size_t kOpenTracksMax = 2000;

}  // namespace

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
  const int64_t from_tenths = ToTenthsFloor(tail->box_t0, commit->spec);
  const int64_t to_tenths = ToTenthsCeil(t1, commit->spec);
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
    commit->head.sums.AddPose(PoseIdentity(append.agent, stored, commit->spec.codec, &scratch));
    DSG_RETURN_IF_ERROR(AppendPose(stored, tail, commit));
  }
  DSG_RETURN_IF_ERROR(WriteSegment(tail, commit));
  const TimeNs first_ns = append.poses.front().time_ns;
  const TimeNs last_ns = append.poses.back().time_ns;
  RevisionRecord& head = commit->head;
  head.first_pose_ns = std::min(head.first_pose_ns.value_or(first_ns), first_ns);
  head.last_pose_ns = std::max(head.last_pose_ns.value_or(last_ns), last_ns);
  return WriteMark(*tail, commit);
}

}  // namespace dsg::sqlite
