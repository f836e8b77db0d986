// SPDX-License-Identifier: Apache-2.0
// Poses of the past. A segment of which a part goes is written anew in its place, and the marks
// that say how far the track reached are made right.
#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"
#include "schema/codec/trajectory_codec.h"
#include "schema/store/sqlite/erased_rows.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

struct Mark {
  Revision revision = 0;
  TimeNs last_ns = kTimeMin;
  int64_t pose_count = 0;
};

struct Segment {
  int64_t id = 0;
  Revision rev_from = 0;
  Revision rev_to = kRevisionMax;
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::vector<StoredPose> poses;
  size_t payload_bytes = 0;
};

constexpr char kSelectPast[] =
    "SELECT id, rev_from, t0, t1, pose_count, checksum, payload, rev_to FROM trajectory_history"
    " WHERE id BETWEEN ?1 AND ?2 AND t0 < ?4 AND t1 >= ?3";
constexpr char kSelectCurrent[] =
    "SELECT id, rev_from, t0, t1, pose_count, checksum, payload, 9223372036854775807"
    " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 AND t0 < ?4 AND t1 >= ?3";

// Columns: id, rev_from, t0, t1, pose_count, checksum. False if the row is not what was written.
bool DecodeRow(const Query& query, const std::string& payload, std::vector<StoredPose>* poses) {
  const int64_t checksum =
      RowChecksum({query.Int(0), query.Int(1), query.Int(2), query.Int(3), query.Int(4)}, payload);
  if (checksum != query.Int(5)) return false;
  const auto reader = SegmentReader::Parse(payload);
  return reader != nullptr && reader->DecodeAll(poses);
}

// One agent's track while poses are taken out of it.
class TrackEraser {
 public:
  TrackEraser(NodeId agent, int64_t slot, ErasedRows* erased)
      : agent_(agent), slot_(slot), erased_(*erased), db_(erased->db) {}

  absl::Status Load() {
    Query query(db_,
                "SELECT revision, last_ns, pose_count FROM track_mark WHERE slot = ?1"
                " ORDER BY revision");
    query.Bind(slot_);
    while (query.Next()) marks_.push_back({query.Int(0), query.Int(1), query.Int(2)});
    return query.status();
  }

  absl::Status ErasePast(const TrackSpan& span) {
    DSG_ASSIGN_OR_RETURN(std::vector<Segment> segments,
                         ReadSegments(kSelectPast, span.from_ns, span.to_ns));
    for (Segment& segment : segments) DSG_RETURN_IF_ERROR(Cut(span, std::move(segment)));
    return RepairMarks();
  }

  absl::Status EraseAll() {
    for (const char* sql : {kSelectPast, kSelectCurrent}) {
      DSG_ASSIGN_OR_RETURN(const std::vector<Segment> segments,
                           ReadSegments(sql, kTimeMin, kTimeMax));
      for (const Segment& segment : segments) DSG_RETURN_IF_ERROR(Take(segment, segment.poses));
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
  absl::StatusOr<std::vector<Segment>> ReadSegments(const char* sql, TimeNs from_ns, TimeNs to_ns) {
    std::vector<Segment> segments;
    Query query(db_, sql);
    query.Bind(FirstSegmentId(slot_), LastSegmentId(slot_), from_ns, to_ns);
    while (query.Next()) {
      Segment segment{query.Int(0), query.Int(1), query.Int(7), query.Int(2), query.Int(3), {}, 0};
      const std::string payload(query.Blob(6));
      segment.payload_bytes = payload.size();
      if (!DecodeRow(query, payload, &segment.poses)) {
        return CorruptRow(db_.map_name(), "trajectory_history", absl::StrCat(segment.id));
      }
      segments.push_back(std::move(segment));
    }
    DSG_RETURN_IF_ERROR(query.status());
    return segments;
  }

  // A pose came with the first mark that reaches it, but not before its segment.
  absl::Status Take(const Segment& segment, const std::vector<StoredPose>& poses) {
    auto mark = std::lower_bound(marks_.begin(), marks_.end(), segment.rev_from,
                                 [](const Mark& a, Revision b) { return a.revision < b; });
    std::map<Revision, RowSums> sums;
    std::string scratch;
    for (const StoredPose& pose : poses) {
      while (mark != marks_.end() && mark->last_ns < pose.time_ns) ++mark;
      if (mark == marks_.end()) {
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

  absl::Status Cut(const TrackSpan& span, Segment segment) {
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
  absl::Status WriteRest(const Segment& segment, const std::vector<StoredPose>& rest) {
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

  absl::Status Insert(const Segment& segment, int64_t id, const SegmentEncoder& encoder) {
    const std::string payload = encoder.Encode();
    const TimeNs t0 = encoder.poses().front().time_ns;
    const TimeNs t1 = encoder.poses().back().time_ns;
    const auto count = static_cast<int64_t>(encoder.poses().size());
    return Query(db_,
                 "INSERT INTO trajectory_history"
                 " (id, rev_from, rev_to, t0, t1, pose_count, checksum, payload)"
                 " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")
        .Bind(id, segment.rev_from, segment.rev_to, t0, t1, count,
              RowChecksum({id, segment.rev_from, t0, t1, count}, payload), Query::BlobView{payload})
        .Run();
  }

  absl::Status RepairMarks() {
    if (gone_.empty()) return absl::OkStatus();
    int64_t fewer = 0;
    auto change = fewer_.begin();
    for (const Mark& mark : marks_) {
      for (; change != fewer_.end() && change->first <= mark.revision; ++change) {
        fewer += change->second;
      }
      TimeNs last_ns = mark.last_ns;
      if (IsGone(last_ns, mark.revision)) {
        DSG_ASSIGN_OR_RETURN(last_ns, LastTime(mark));
      }
      if (fewer == 0 && last_ns == mark.last_ns) continue;
      DSG_RETURN_IF_ERROR(Query(db_,
                                "UPDATE track_mark SET last_ns = ?3, pose_count = ?4"
                                " WHERE slot = ?1 AND revision = ?2")
                              .Bind(slot_, mark.revision, last_ns, mark.pose_count - fewer)
                              .Run());
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
  absl::StatusOr<TimeNs> LastTime(const Mark& mark) {
    TimeNs last_ns = kTimeMin;
    for (const char* sql :
         {"SELECT id, rev_from, t0, t1, pose_count, checksum, payload FROM trajectory_segment"
          " WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3 AND t0 <= ?4 ORDER BY id DESC LIMIT 1",
          "SELECT id, rev_from, t0, t1, pose_count, checksum, payload FROM trajectory_history"
          " WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3 AND rev_to > ?3 AND t0 <= ?4"
          " ORDER BY id DESC LIMIT 1"}) {
      Query query(db_, sql);
      query.Bind(FirstSegmentId(slot_), LastSegmentId(slot_), mark.revision, mark.last_ns);
      const bool found = query.Next();
      DSG_RETURN_IF_ERROR(query.status());
      if (!found) continue;
      std::vector<StoredPose> poses;
      if (!DecodeRow(query, std::string(query.Blob(6)), &poses)) {
        return CorruptRow(db_.map_name(), "trajectory_segment", ToString(agent_));
      }
      for (const StoredPose& pose : poses) {
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
  std::vector<Mark> marks_;
  /// By time: poses that went, and the revisions that showed them.
  std::multimap<TimeNs, Stretch> gone_;
  /// By how much the numbers of poses shrink at each revision.
  std::map<Revision, int64_t> fewer_;
};

absl::StatusOr<int64_t> FindSlot(Database& db, NodeId agent) {
  Query query(db, "SELECT slot FROM track WHERE agent = ?1");
  const bool found = query.Bind(KeyOf(agent)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : 0;
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

}  // namespace dsg::sqlite
