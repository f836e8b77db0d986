// SPDX-License-Identifier: Apache-2.0
// Corrections of tracks: only the segments that one touches are written anew.
#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/track_writer_internal.h"

namespace dsg::sqlite {

// Moves the segments that touch [from_ns, to_ns) to the history and hands out their poses.
// `next_id` becomes the segment after them, 0 if there is none.
absl::Status TrackWriter::TakeSegments(TimeNs from_ns, TimeNs to_ns, Tail* tail,
                                       std::vector<StoredPose>* poses, int64_t* next_id,
                                       CommitContext* commit) {
  std::vector<SegmentRow> rows;
  *next_id = 0;
  {
    // Ids hardly run ahead of times, so what touches the span begins at most a few segments before
    // the id that its begin would have.
    Query query(commit->db,
                "SELECT id, rev_from, t0, t1, pose_count, checksum, payload"
                " FROM trajectory_segment WHERE id BETWEEN"
                "  coalesce((SELECT id FROM trajectory_segment WHERE id BETWEEN ?1 AND ?3"
                "   ORDER BY id DESC LIMIT 1 OFFSET 8), ?1)"
                " AND ?2 AND t1 >= ?4 ORDER BY id");
    query.Bind(FirstSegmentId(tail->slot), LastSegmentId(tail->slot),
               SegmentId(tail->slot, from_ns, commit->spec), from_ns);
    while (query.Next()) {
      if (query.Int(2) >= to_ns) {
        *next_id = query.Int(0);
        break;
      }
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

// The end of the track before segment `next_id` (0 = of the whole track), to be gone on from.
absl::Status TrackWriter::LoadSegmentBefore(int64_t next_id, Tail* tail, CommitContext* commit) {
  Query query(commit->db, kSelectLast);
  query.Bind(FirstSegmentId(tail->slot), next_id == 0 ? LastSegmentId(tail->slot) : next_id - 1);
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const SegmentRow row, DecodeSegmentRow(query, commit->spec));
  tail->segment_id = row.id;
  tail->last = row.poses.back();
  return absl::OkStatus();
}

// The way to segment `id` begins at another pose than before. For readers of older revisions its
// box still covers the old way.
absl::Status TrackWriter::ExtendBox(int64_t id, const StoredPose& before, CommitContext* commit) {
  Box3d point;
  Grow(before, commit->spec.codec, &point);
  const IntBox box = ToMillimetres(point);
  const int64_t from_tenths = ToTenthsFloor(before.time_ns, commit->spec);
  return Query(commit->db,
               "UPDATE segment_box SET x0 = min(x0, ?2), x1 = max(x1, ?3), y0 = min(y0, ?4),"
               " y1 = max(y1, ?5), z0 = min(z0, ?6), z1 = max(z1, ?7), t0 = min(t0, ?8)"
               " WHERE id = ?1")
      .Bind(id, box.x0, box.x1, box.y0, box.y1, box.z0, box.z1, from_tenths)
      .Run();
}

// Puts `poses` between the segment before and segment `next_id`.
absl::Status TrackWriter::WriteBetween(std::vector<StoredPose> poses, int64_t next_id, Tail* tail,
                                       CommitContext* commit) {
  DSG_RETURN_IF_ERROR(LoadSegmentBefore(next_id, tail, commit));
  // The segment before stays as it is: begin a new one.
  tail->encoder = SegmentEncoder(commit->spec.codec);
  for (size_t i = 0; i < poses.size(); ++i) {
    DSG_RETURN_IF_ERROR(AppendPose(poses[i], tail, commit));
    if (next_id == 0 || tail->segment_id < next_id) continue;
    // No id is left before the next segment: write the rest of the track anew.
    DSG_RETURN_IF_ERROR(
        TakeSegments(poses.back().time_ns, kTimeMax, tail, &poses, &next_id, commit));
  }
  if (!tail->encoder.empty()) DSG_RETURN_IF_ERROR(WriteSegment(tail, commit));
  if (next_id == 0) return absl::OkStatus();
  if (tail->last.has_value()) DSG_RETURN_IF_ERROR(ExtendBox(next_id, *tail->last, commit));
  // The mark tells of the end of the whole track.
  return LoadSegmentBefore(0, tail, commit);
}

// Rewrites the segments that the correction touches, and no others.
absl::Status TrackWriter::Correct(const TrajectoryCorrection& correction, CommitContext* commit) {
  tails_.erase(correction.agent);
  const TrajectoryCodec codec = commit->spec.codec;
  DSG_ASSIGN_OR_RETURN(const Tail* const loaded, LoadTail(correction.agent, commit));
  Tail tail;
  tail.agent = correction.agent;
  tail.slot = loaded->slot;
  tail.pose_count = loaded->pose_count;
  tails_.erase(correction.agent);
  std::vector<StoredPose> poses;
  int64_t next_id = 0;
  DSG_RETURN_IF_ERROR(
      TakeSegments(correction.from_ns, correction.to_ns, &tail, &poses, &next_id, commit));
  bool is_at_end = false;
  std::string scratch;
  std::erase_if(poses, [&](const StoredPose& pose) {
    const bool replaced = correction.from_ns <= pose.time_ns && pose.time_ns < correction.to_ns;
    if (replaced) {
      commit->head.sums.RemovePose(PoseIdentity(correction.agent, pose, codec, &scratch));
      is_at_end |=
          pose.time_ns == commit->head.first_pose_ns || pose.time_ns == commit->head.last_pose_ns;
    }
    return replaced;
  });
  for (const TimedPose& pose : correction.poses) {
    poses.push_back(ToStored(pose, codec));
    commit->head.sums.AddPose(PoseIdentity(correction.agent, poses.back(), codec, &scratch));
    is_at_end |=
        !commit->head.first_pose_ns.has_value() || pose.time_ns < *commit->head.first_pose_ns;
  }
  std::sort(poses.begin(), poses.end(),
            [](const StoredPose& a, const StoredPose& b) { return a.time_ns < b.time_ns; });
  DSG_RETURN_IF_ERROR(WriteBetween(std::move(poses), next_id, &tail, commit));
  DSG_RETURN_IF_ERROR(WriteMark(tail, commit));
  return is_at_end ? FindEnds(commit) : absl::OkStatus();
}

// First and last pose of all tracks, by one seek to each end of each.
absl::Status TrackWriter::FindEnds(CommitContext* commit) {
  Query span(commit->db,
             "SELECT min((SELECT t0 FROM trajectory_segment WHERE id BETWEEN slot << 42 AND"
             "  ((slot + 1) << 42) - 1 ORDER BY id LIMIT 1)),"
             " max((SELECT t1 FROM trajectory_segment WHERE id BETWEEN slot << 42 AND"
             "  ((slot + 1) << 42) - 1 ORDER BY id DESC LIMIT 1)) FROM track");
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
