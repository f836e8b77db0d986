// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/track_writer.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"

namespace dsg::sqlite {
namespace {

// Tracks kept open between commits; beyond, all are reloaded when needed.
constexpr size_t kOpenTracksMax = 2000;

void Grow(const StoredPose& pose, TrajectoryCodec codec, Box3d* box) {
  box->extend(PositionOf(pose, codec));
}

// First and last pose of all tracks, by one seek to each end of each.
absl::Status FindTrackEnds(CommitContext* commit) {
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
  SegmentBox box;
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
  DSG_ASSIGN_OR_RETURN(tail.slot, FindSlot(commit->db, agent));
  if (tail.slot == 0) {
    DSG_ASSIGN_OR_RETURN(tail.slot, AddSlot(commit->db, agent));
  } else {
    DSG_ASSIGN_OR_RETURN(const auto mark, FindMark(commit->db, tail.slot, kRevisionMax));
    if (mark.has_value()) tail.pose_count = mark->pose_count;
    DSG_RETURN_IF_ERROR(LoadOpenSegment(&tail, commit));
  }
  return (tails_[agent] = std::move(made)).get();
}

absl::Status TrackWriter::LoadOpenSegment(Tail* tail, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const auto row, FindLastSegment(commit->db, FirstSegmentId(tail->slot),
                                                       LastSegmentId(tail->slot)));
  if (!row.has_value()) return absl::OkStatus();
  tail->segment_id = row->id;
  tail->last = row->poses.back();
  DSG_ASSIGN_OR_RETURN(const TimeNs reached_ns,
                       FurthestMark(commit->db, tail->slot, row->rev_from));
  // The track has lost its end since: in the revisions of then a pose that is appended in place
  // would be one of theirs. The encoder stays empty, and the next pose begins a segment.
  if (reached_ns > tail->last->time_ns) return absl::OkStatus();
  tail->segment_stored = true;
  tail->segment_rev_from = row->rev_from;
  for (const StoredPose& pose : row->poses) {
    // What fitted once fits again: the encoder is deterministic.
    if (!tail->encoder.Add(pose)) {
      return CorruptRow(commit->spec.name, "trajectory_segment", absl::StrCat(row->id));
    }
  }
  DSG_ASSIGN_OR_RETURN(tail->box, ReadSegmentBox(commit->db, commit->spec, row->id));
  tail->box.t0 = std::min(tail->box.t0, row->poses.front().time_ns);
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
    tail->box.box_map.setEmpty();
    tail->box.t0 = pose.time_ns;
    // Also across what is a gap here: an agent may have a longer limit of its own.
    if (tail->last.has_value()) {
      Grow(*tail->last, commit->spec.codec, &tail->box.box_map);
      tail->box.t0 = tail->last->time_ns;
    }
  }
  Grow(pose, commit->spec.codec, &tail->box.box_map);
  tail->last = pose;
  ++tail->pose_count;
  return absl::OkStatus();
}

absl::Status TrackWriter::WriteSegment(Tail* tail, CommitContext* commit) {
  const auto write = tail->segment_stored ? UpdateSegment : InsertSegment;
  DSG_RETURN_IF_ERROR(write(commit->db, tail->segment_id, tail->segment_rev_from, tail->encoder));
  tail->segment_stored = true;
  tail->box.t1 = tail->encoder.poses().back().time_ns;
  return WriteSegmentBox(commit->db, commit->spec, tail->segment_id, tail->box);
}

absl::Status TrackWriter::EndAtMark(const Tail& tail, CommitContext* commit) {
  commit->touched.tracks.push_back(tail.agent);
  // An emptied track ends before all time.
  const TimeNs last_ns = tail.last.has_value() ? tail.last->time_ns : kTimeMin;
  return WriteMark(commit->db, tail.slot, {commit->revision(), last_ns, tail.pose_count});
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
  return EndAtMark(*tail, commit);
}

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
                "SELECT " DSG_SEGMENT_COLUMNS
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
      DSG_ASSIGN_OR_RETURN(SegmentRow row, SegmentRowOf(query, commit->spec.name));
      rows.push_back(std::move(row));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (SegmentRow& row : rows) {
    DSG_RETURN_IF_ERROR(EndSegment(commit->db, row.id, commit->revision()));
    tail->pose_count -= std::ssize(row.poses);
    poses->insert(poses->end(), std::make_move_iterator(row.poses.begin()),
                  std::make_move_iterator(row.poses.end()));
  }
  return absl::OkStatus();
}

// The end of the track before segment `next_id` (0 = of the whole track), to be gone on from.
absl::Status TrackWriter::LoadSegmentBefore(int64_t next_id, Tail* tail, CommitContext* commit) {
  const int64_t last_id = next_id == 0 ? LastSegmentId(tail->slot) : next_id - 1;
  DSG_ASSIGN_OR_RETURN(const auto row,
                       FindLastSegment(commit->db, FirstSegmentId(tail->slot), last_id));
  if (!row.has_value()) return absl::OkStatus();
  tail->segment_id = row->id;
  tail->last = row->poses.back();
  return absl::OkStatus();
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
  // The way to that segment begins at another pose than before. For readers of older revisions its
  // box still covers the old way.
  if (tail->last.has_value()) {
    DSG_RETURN_IF_ERROR(ExtendSegmentBox(commit->db, commit->spec, next_id, *tail->last));
  }
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
  DSG_RETURN_IF_ERROR(EndAtMark(tail, commit));
  return is_at_end ? FindTrackEnds(commit) : absl::OkStatus();
}

absl::Status TrackWriter::End(NodeId agent, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const int64_t slot, FindSlot(commit->db, agent));
  if (slot == 0) return absl::OkStatus();
  return Correct({agent, kTimeMin, kTimeMax, {}}, commit);
}

}  // namespace dsg::sqlite
