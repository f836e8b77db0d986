// SPDX-License-Identifier: Apache-2.0
// Poses of the past. A segment of which a part goes is written anew in its place, and the marks
// that say how far the track reached are made right.
#include <algorithm>
#include <map>
#include <set>

#include "schema/codec/trajectory_codec.h"
#include "schema/store/sqlite/erased_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"

namespace dsg::sqlite {
namespace {

constexpr char kPastSegments[] =
    "SELECT " DSG_SEGMENT_COLUMNS
    ", rev_to"
    " FROM trajectory_history WHERE id BETWEEN ?1 AND ?2 AND t0 < ?4 AND t1 >= ?3";
constexpr char kCurrentSegments[] =
    "SELECT " DSG_SEGMENT_COLUMNS
    ", 9223372036854775807"
    " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 AND t0 < ?4 AND t1 >= ?3";
// The last segments that a mark may reach into.
constexpr char kLastPastSegment[] =
    "SELECT " DSG_SEGMENT_COLUMNS
    " FROM trajectory_history WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3 AND rev_to > ?3"
    " AND t0 <= ?4 ORDER BY id DESC LIMIT 1";
constexpr char kLastCurrentSegment[] =
    "SELECT " DSG_SEGMENT_COLUMNS
    " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3 AND t0 <= ?4"
    " ORDER BY id DESC LIMIT 1";

struct PastSegment : SegmentRow {
  Revision rev_to = kRevisionMax;
};

// One agent's track while poses are taken out of it.
class TrackEraser {
 public:
  TrackEraser(NodeId agent, int64_t slot, ErasedRows* erased)
      : agent_(agent), slot_(slot), erased_(*erased), db_(erased->db) {}

  absl::Status Load() {
    DSG_ASSIGN_OR_RETURN(marks_, ReadMarks(db_, slot_));
    return absl::OkStatus();
  }

  absl::Status ErasePast(const TrackSpan& span) {
    DSG_ASSIGN_OR_RETURN(std::vector<PastSegment> segments,
                         ReadSegments(kPastSegments, span.from_ns, span.to_ns));
    for (PastSegment& segment : segments) DSG_RETURN_IF_ERROR(Cut(span, std::move(segment)));
    return RepairMarks();
  }

  absl::Status EraseAll() {
    for (const char* sql : {kPastSegments, kCurrentSegments}) {
      DSG_ASSIGN_OR_RETURN(const std::vector<PastSegment> segments,
                           ReadSegments(sql, kTimeMin, kTimeMax));
      for (const PastSegment& segment : segments) DSG_RETURN_IF_ERROR(Take(segment, segment.poses));
    }
    erased_.past.forgotten.ForgetTrack(agent_);
    for (const char* sql : {"DELETE FROM trajectory_history WHERE id BETWEEN ?1 AND ?2",
                            "DELETE FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2",
                            "DELETE FROM segment_box WHERE id BETWEEN ?1 AND ?2"}) {
      DSG_RETURN_IF_ERROR(Query(db_, sql).Bind(FirstSegmentId(slot_), LastSegmentId(slot_)).Run());
    }
    for (const char* sql :
         {"DELETE FROM track_mark WHERE slot = ?1", "DELETE FROM track WHERE slot = ?1"}) {
      DSG_RETURN_IF_ERROR(Query(db_, sql).Bind(slot_).Run());
    }
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<std::vector<PastSegment>> ReadSegments(const char* sql, TimeNs from_ns,
                                                        TimeNs to_ns) {
    std::vector<PastSegment> segments;
    Query query(db_, sql);
    query.Bind(FirstSegmentId(slot_), LastSegmentId(slot_), from_ns, to_ns);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(SegmentRow row, SegmentRowOf(query, db_.map_name()));
      segments.push_back({std::move(row), query.Int(7)});
    }
    DSG_RETURN_IF_ERROR(query.status());
    return segments;
  }

  // A pose came with the first mark that reaches it, but not before its segment.
  absl::Status Take(const PastSegment& segment, const std::vector<StoredPose>& poses) {
    auto mark = std::lower_bound(marks_.begin(), marks_.end(), segment.rev_from,
                                 [](const TrackMark& a, Revision b) { return a.revision < b; });
    std::map<Revision, RowSums> sums;
    std::string scratch;
    for (const StoredPose& pose : poses) {
      while (mark != marks_.end() && mark->last_ns < pose.time_ns) ++mark;
      if (mark == marks_.end() || mark->revision >= segment.rev_to) {
        // Its mark is compacted away: no revision shows the pose, so none counts it.
        if (segment.rev_to != kRevisionMax) break;
        return CorruptRow(db_.map_name(), "track_mark", ToString(agent_));
      }
      RowSums& of_mark = sums[mark->revision];
      of_mark.AddPose(PoseIdentity(agent_, pose, erased_.spec.codec, &scratch));
      gone_.emplace(pose.time_ns, Stretch{mark->revision, segment.rev_to});
    }
    for (const auto& [revision, of_mark] : sums) {
      erased_.past.Take(of_mark, revision, segment.rev_to);
      fewer_[revision] += of_mark.pose_count;
      fewer_[segment.rev_to] -= of_mark.pose_count;
    }
    ++erased_.row_count;
    erased_.pose_count += static_cast<int64_t>(poses.size());
    erased_.byte_count += static_cast<int64_t>(segment.payload_bytes);
    return absl::OkStatus();
  }

  absl::Status Cut(const TrackSpan& span, PastSegment segment) {
    std::vector<StoredPose> out;
    std::vector<StoredPose> rest;
    for (StoredPose& pose : segment.poses) {
      const bool goes = span.from_ns <= pose.time_ns && pose.time_ns < span.to_ns;
      (goes ? out : rest).push_back(std::move(pose));
    }
    if (out.empty()) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(Take(segment, out));
    DSG_RETURN_IF_ERROR(Query(db_, "DELETE FROM trajectory_history WHERE id = ?1 AND rev_from = ?2")
                            .Bind(segment.id, segment.rev_from)
                            .Run());
    return WriteRest(segment, rest);
  }

  // With a hole in it a segment may not fit its size any more; then it becomes two.
  absl::Status WriteRest(const PastSegment& segment, const std::vector<StoredPose>& rest) {
    SegmentEncoder encoder(erased_.spec.codec);
    int64_t id = segment.id;
    for (const StoredPose& pose : rest) {
      if (encoder.Add(pose)) continue;
      DSG_RETURN_IF_ERROR(Insert(segment, id, encoder));
      DSG_ASSIGN_OR_RETURN(id, FreeIdAfter(id, segment.rev_from));
      encoder = SegmentEncoder(erased_.spec.codec);
      encoder.Add(pose);
    }
    return encoder.empty() ? absl::OkStatus() : Insert(segment, id, encoder);
  }

  // Ids order the segments of a track, and those of one revision must not be the same.
  absl::StatusOr<int64_t> FreeIdAfter(int64_t id, Revision rev_from) {
    for (;;) {
      ++id;
      Query query(db_, "SELECT 1 FROM trajectory_history WHERE id = ?1 AND rev_from = ?2");
      const bool is_taken = query.Bind(id, rev_from).Next();
      DSG_RETURN_IF_ERROR(query.status());
      if (!is_taken) return id;
    }
  }

  absl::Status Insert(const PastSegment& segment, int64_t id, const SegmentEncoder& encoder) {
    return InsertPastSegment(db_, id, segment.rev_from, segment.rev_to, encoder);
  }

  absl::Status RepairMarks() {
    if (gone_.empty()) return absl::OkStatus();
    int64_t fewer = 0;
    auto change = fewer_.begin();
    for (const TrackMark& mark : marks_) {
      for (; change != fewer_.end() && change->first <= mark.revision; ++change) {
        fewer += change->second;
      }
      TimeNs last_ns = mark.last_ns;
      if (IsGone(last_ns, mark.revision)) {
        DSG_ASSIGN_OR_RETURN(last_ns, LastTime(mark));
      }
      if (fewer == 0 && last_ns == mark.last_ns) continue;
      DSG_RETURN_IF_ERROR(WriteMark(db_, slot_, {mark.revision, last_ns, mark.pose_count - fewer}));
    }
    return absl::OkStatus();
  }

  bool IsGone(TimeNs time_ns, Revision revision) const {
    const auto [begin, end] = gone_.equal_range(time_ns);
    return std::any_of(begin, end, [&](const auto& gone) {
      return gone.second.from <= revision && revision < gone.second.to;
    });
  }

  // Of the last pose that is left of what the mark reached.
  absl::StatusOr<TimeNs> LastTime(const TrackMark& mark) {
    TimeNs last_ns = kTimeMin;
    for (const char* sql : {kLastCurrentSegment, kLastPastSegment}) {
      Query query(db_, sql);
      query.Bind(FirstSegmentId(slot_), LastSegmentId(slot_), mark.revision, mark.last_ns);
      const bool found = query.Next();
      DSG_RETURN_IF_ERROR(query.status());
      if (!found) continue;
      DSG_ASSIGN_OR_RETURN(const SegmentRow row, SegmentRowOf(query, db_.map_name()));
      for (const StoredPose& pose : row.poses) {
        if (pose.time_ns <= mark.last_ns) last_ns = std::max(last_ns, pose.time_ns);
      }
    }
    return last_ns;
  }

  struct Stretch {
    Revision from = 0;
    Revision to = 0;
  };

  const NodeId agent_;
  const int64_t slot_;
  ErasedRows& erased_;
  Database& db_;
  std::vector<TrackMark> marks_;
  /// By time: poses that went, and the revisions that showed them.
  std::multimap<TimeNs, Stretch> gone_;
  /// By how much the numbers of poses shrink at each revision.
  std::map<Revision, int64_t> fewer_;
};

// Values that begin and end with revisions, and the least or largest of those there are.
class Lifetimes {
 public:
  void Add(TimeNs value, Revision from, Revision to) {
    begins_.emplace(from, value);
    if (to != kRevisionMax) ends_.emplace(to, value);
  }

  /// Of revisions that only grow from call to call.
  const std::multiset<TimeNs>& At(Revision revision) {
    for (; next_begin_ != begins_.end() && next_begin_->first <= revision; ++next_begin_) {
      now_.insert(next_begin_->second);
    }
    for (; next_end_ != ends_.end() && next_end_->first <= revision; ++next_end_) {
      now_.erase(now_.find(next_end_->second));
    }
    return now_;
  }

  void Start() {
    next_begin_ = begins_.begin();
    next_end_ = ends_.begin();
  }

 private:
  std::multimap<Revision, TimeNs> begins_;
  std::multimap<Revision, TimeNs> ends_;
  std::multimap<Revision, TimeNs>::const_iterator next_begin_;
  std::multimap<Revision, TimeNs>::const_iterator next_end_;
  std::multiset<TimeNs> now_;
};

// A segment is seen from the revision on that wrote it, with its first pose.
absl::Status ReadPoseBegins(Database& db, Lifetimes* begins) {
  Query query(db,
              "SELECT rev_from, 9223372036854775807, t0 FROM trajectory_segment"
              " UNION ALL SELECT rev_from, rev_to, t0 FROM trajectory_history");
  while (query.Next()) begins->Add(query.Int(2), query.Int(0), query.Int(1));
  return query.status();
}

absl::Status ReadPoseEnds(Database& db, Lifetimes* ends) {
  Query query(db,
              "SELECT revision, last_ns, pose_count, lead(revision) OVER"
              " (PARTITION BY slot ORDER BY revision) FROM track_mark");
  while (query.Next()) {
    const TrackMark mark = MarkFromRow(query);
    if (mark.pose_count == 0) continue;
    ends->Add(mark.last_ns, mark.revision, query.IsNull(3) ? kRevisionMax : query.Int(3));
  }
  return query.status();
}

}  // namespace

absl::Status ErasePoses(const TrackSpan& span, ErasedRows* erased) {
  DSG_ASSIGN_OR_RETURN(const int64_t slot, FindSlot(erased->db, span.agent));
  if (slot == 0) return absl::OkStatus();
  TrackEraser eraser(span.agent, slot, erased);
  DSG_RETURN_IF_ERROR(eraser.Load());
  return eraser.ErasePast(span);
}

absl::Status EraseTrack(NodeId agent, ErasedRows* erased) {
  DSG_ASSIGN_OR_RETURN(const int64_t slot, FindSlot(erased->db, agent));
  if (slot == 0) return absl::OkStatus();
  TrackEraser eraser(agent, slot, erased);
  DSG_RETURN_IF_ERROR(eraser.Load());
  return eraser.EraseAll();
}

absl::Status RepairPoseTimes(Database& db) {
  Lifetimes begins;
  Lifetimes ends;
  DSG_RETURN_IF_ERROR(ReadPoseBegins(db, &begins));
  DSG_RETURN_IF_ERROR(ReadPoseEnds(db, &ends));
  begins.Start();
  ends.Start();
  std::vector<RevisionRecord> wrong;
  {
    Query query(db, "SELECT " DSG_REVISION_COLUMNS " FROM revision ORDER BY revision");
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, db.map_name()));
      const auto& first = begins.At(head.info.revision);
      const auto& last = ends.At(head.info.revision);
      std::optional<TimeNs> first_ns;
      std::optional<TimeNs> last_ns;
      // A segment may begin where no mark shows its poses any more.
      if (!first.empty() && !last.empty()) {
        first_ns = *first.begin();
        last_ns = *last.rbegin();
      }
      if (head.first_pose_ns == first_ns && head.last_pose_ns == last_ns) continue;
      head.first_pose_ns = first_ns;
      head.last_pose_ns = last_ns;
      wrong.push_back(std::move(head));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const RevisionRecord& head : wrong) DSG_RETURN_IF_ERROR(UpdateRevision(db, head));
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
