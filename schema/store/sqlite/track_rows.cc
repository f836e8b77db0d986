// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/track_rows.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/snapshot.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

// The columns of a segment that follow from its poses.
struct SegmentColumns {
  SegmentColumns(int64_t id, Revision rev_from, const SegmentEncoder& poses)
      : payload(poses.Encode()),
        t0(poses.poses().front().time_ns),
        t1(poses.poses().back().time_ns),
        pose_count(std::ssize(poses.poses())),
        checksum(RowChecksum({id, rev_from, t0, t1, pose_count}, payload)) {}

  const std::string payload;
  const TimeNs t0;
  const TimeNs t1;
  const int64_t pose_count;
  const int64_t checksum;
};

// Rows that may touch [?3, ?4) as of ?5. The lengths are written as the partial indices have them,
// and SQLite computes them without overflow.
#define DSG_STAY_COLUMNS "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum FROM "
#define DSG_SHORT_STAYS(column)                                        \
  " WHERE " column                                                     \
  " = ?1 AND enter_ns >= ?2 AND enter_ns < ?4 AND exit_ns - enter_ns " \
  "<= " DSG_HOUR
#define DSG_LONG_STAYS(column) \
  " WHERE " column " = ?1 AND exit_ns > ?3 AND +enter_ns < ?4 AND exit_ns - enter_ns > " DSG_HOUR
#define DSG_HOUR "3600000000000"
#define DSG_STAYS_IN(column) \
  DSG_STAY_COLUMNS "stay" DSG_SHORT_STAYS(column) " AND +rev_from <= ?5 UNION ALL "               \
  DSG_STAY_COLUMNS "stay" DSG_LONG_STAYS(column) " AND +rev_from <= ?5 UNION ALL "                \
  DSG_STAY_COLUMNS "stay_history" DSG_SHORT_STAYS(column)                                         \
  " AND +rev_from <= ?5 AND +rev_to > ?5 UNION ALL "                                              \
  DSG_STAY_COLUMNS "stay_history" DSG_LONG_STAYS(column) " AND +rev_from <= ?5 AND +rev_to > ?5"

constexpr char kSelectStay[] =
    "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum FROM stay"
    " WHERE agent = ?1 AND enter_ns = ?2";

absl::Status EndStay(const StayRow& row, CommitContext* commit) {
  const int64_t agent = KeyOf(row.agent);
  const TimeNs enter_ns = row.enter_ns;
  commit->head.sums.Remove(row);
  DSG_RETURN_IF_ERROR(
      Query(commit->db,
            "INSERT INTO stay_history"
            " (agent, enter_ns, exit_ns, place, room, rev_from, rev_to, checksum)"
            " SELECT agent, enter_ns, exit_ns, place, room, rev_from, ?3, checksum FROM stay"
            " WHERE agent = ?1 AND enter_ns = ?2")
          .Bind(agent, enter_ns, commit->revision())
          .Run());
  return Query(commit->db, "DELETE FROM stay WHERE agent = ?1 AND enter_ns = ?2")
      .Bind(agent, enter_ns)
      .Run();
}

absl::Status WriteStay(const Stay& stay, CommitContext* commit) {
  const int64_t agent = KeyOf(stay.agent);
  {
    Query current(commit->db, kSelectStay);
    const bool exists = current.Bind(agent, stay.enter_ns).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (exists) {
      DSG_ASSIGN_OR_RETURN(const StayRow known, StayRowOf(current, commit->spec.name));
      if (known.stay() == stay) return absl::OkStatus();
      DSG_RETURN_IF_ERROR(EndStay(known, commit));
    }
  }
  const StayRow row{stay.agent, stay.enter_ns, stay.exit_ns,
                    stay.place, stay.room,     commit->revision()};
  commit->head.sums.Add(row);
  return Query(commit->db,
               "INSERT INTO stay (agent, enter_ns, exit_ns, place, room, rev_from, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
      .Bind(agent, stay.enter_ns, stay.exit_ns, KeyOf(stay.place), KeyOf(stay.room),
            commit->revision(), ChecksumOf(row))
      .Run();
}

}  // namespace

absl::StatusOr<int64_t> FindSlot(Database& db, NodeId agent) {
  Query query(db, "SELECT slot FROM track WHERE agent = ?1");
  const bool found = query.Bind(KeyOf(agent)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : 0;
}

absl::StatusOr<int64_t> AddSlot(Database& db, NodeId agent) {
  DSG_ASSIGN_OR_RETURN(const int64_t last_slot,
                       db.QueryInt("SELECT coalesce(max(slot), 0) FROM track"));
  const int64_t slot = last_slot + 1;
  if (slot >= int64_t{1} << (63 - kSegmentTimeBits)) {
    return MakeError(Reason::kLimitExceeded, "a map holds at most two million tracks",
                     {{"map", db.map_name()}});
  }
  DSG_RETURN_IF_ERROR(
      Query(db, "INSERT INTO track (slot, agent) VALUES (?1, ?2)").Bind(slot, KeyOf(agent)).Run());
  return slot;
}

TrackMark MarkFromRow(const Query& query) { return {query.Int(0), query.Int(1), query.Int(2)}; }

absl::StatusOr<std::optional<TrackMark>> FindMark(Database& db, int64_t slot, Revision revision) {
  Query query(db,
              "SELECT revision, last_ns, pose_count FROM track_mark"
              " WHERE slot = ?1 AND revision <= ?2 ORDER BY revision DESC LIMIT 1");
  const bool found = query.Bind(slot, revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? std::optional(MarkFromRow(query)) : std::nullopt;
}

absl::StatusOr<std::optional<TrackMark>> FindLastMark(Database& db, NodeId agent) {
  Query query(db,
              "SELECT revision, last_ns, pose_count FROM track JOIN track_mark USING (slot)"
              " WHERE agent = ?1 ORDER BY revision DESC LIMIT 1");
  const bool found = query.Bind(KeyOf(agent)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? std::optional(MarkFromRow(query)) : std::nullopt;
}

absl::StatusOr<TimeNs> FurthestMark(Database& db, int64_t slot, Revision revision) {
  Query query(db, "SELECT max(last_ns) FROM track_mark WHERE slot = ?1 AND revision >= ?2");
  const bool found = query.Bind(slot, revision).Next() && !query.IsNull(0);
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : kTimeMin;
}

absl::StatusOr<std::vector<TrackMark>> ReadMarks(Database& db, int64_t slot) {
  std::vector<TrackMark> marks;
  Query query(db,
              "SELECT revision, last_ns, pose_count FROM track_mark WHERE slot = ?1"
              " ORDER BY revision");
  query.Bind(slot);
  while (query.Next()) marks.push_back(MarkFromRow(query));
  DSG_RETURN_IF_ERROR(query.status());
  return marks;
}

absl::Status WriteMark(Database& db, int64_t slot, const TrackMark& mark) {
  return Query(db,
               "INSERT OR REPLACE INTO track_mark (slot, revision, last_ns, pose_count)"
               " VALUES (?1, ?2, ?3, ?4)")
      .Bind(slot, mark.revision, mark.last_ns, mark.pose_count)
      .Run();
}

absl::StatusOr<SegmentPtr> SegmentReaderOf(const Query& query, const std::string& map) {
  std::string payload(query.Blob(6));
  const int64_t checksum =
      RowChecksum({query.Int(0), query.Int(1), query.Int(2), query.Int(3), query.Int(4)}, payload);
  SegmentPtr reader;
  if (checksum == query.Int(5)) reader = SegmentReader::Parse(std::move(payload));
  if (reader != nullptr) return reader;
  return CorruptRow(map, "trajectory_segment", absl::StrCat(query.Int(0)));
}

absl::StatusOr<SegmentRow> SegmentRowOf(const Query& query, const std::string& map) {
  SegmentRow row{query.Int(0), query.Int(1), {}, query.Blob(6).size()};
  DSG_ASSIGN_OR_RETURN(const SegmentPtr reader, SegmentReaderOf(query, map));
  if (reader->DecodeAll(&row.poses)) return row;
  return CorruptRow(map, "trajectory_segment", absl::StrCat(row.id));
}

absl::StatusOr<std::optional<SegmentRow>> FindLastSegment(Database& db, int64_t first_id,
                                                          int64_t last_id) {
  Query query(db, "SELECT " DSG_SEGMENT_COLUMNS
                  " FROM trajectory_segment WHERE id BETWEEN ?1 AND ?2 ORDER BY id DESC LIMIT 1");
  const bool found = query.Bind(first_id, last_id).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<SegmentRow>();
  DSG_ASSIGN_OR_RETURN(SegmentRow row, SegmentRowOf(query, db.map_name()));
  return std::optional<SegmentRow>(std::move(row));
}

absl::Status InsertSegment(Database& db, int64_t id, Revision rev_from,
                           const SegmentEncoder& poses) {
  const SegmentColumns columns(id, rev_from, poses);
  return Query(db,
               "INSERT INTO trajectory_segment"
               " (id, rev_from, t0, t1, pose_count, checksum, payload)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
      .Bind(id, rev_from, columns.t0, columns.t1, columns.pose_count, columns.checksum,
            Query::BlobView{columns.payload})
      .Run();
}

absl::Status UpdateSegment(Database& db, int64_t id, Revision rev_from,
                           const SegmentEncoder& poses) {
  const SegmentColumns columns(id, rev_from, poses);
  return Query(db,
               "UPDATE trajectory_segment SET t1 = ?2, pose_count = ?3,"
               " checksum = ?4, payload = ?5 WHERE id = ?1")
      .Bind(id, columns.t1, columns.pose_count, columns.checksum, Query::BlobView{columns.payload})
      .Run();
}

absl::Status InsertPastSegment(Database& db, int64_t id, Revision rev_from, Revision rev_to,
                               const SegmentEncoder& poses) {
  const SegmentColumns columns(id, rev_from, poses);
  return Query(db,
               "INSERT INTO trajectory_history"
               " (id, rev_from, rev_to, t0, t1, pose_count, checksum, payload)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")
      .Bind(id, rev_from, rev_to, columns.t0, columns.t1, columns.pose_count, columns.checksum,
            Query::BlobView{columns.payload})
      .Run();
}

absl::Status EndSegment(Database& db, int64_t id, Revision revision) {
  // A row of this very revision was never visible, so history need not know it.
  DSG_RETURN_IF_ERROR(Query(db,
                            "INSERT INTO trajectory_history"
                            " SELECT id, rev_from, ?2, t0, t1, pose_count, checksum, payload"
                            " FROM trajectory_segment WHERE id = ?1 AND rev_from < ?2")
                          .Bind(id, revision)
                          .Run());
  DSG_RETURN_IF_ERROR(Query(db, "DELETE FROM trajectory_segment WHERE id = ?1").Bind(id).Run());
  return Query(db, "DELETE FROM segment_box WHERE id = ?1").Bind(id).Run();
}

absl::StatusOr<SegmentBox> ReadSegmentBox(Database& db, const MapSpec& spec, int64_t id) {
  Query query(db, "SELECT x0, x1, y0, y1, z0, z1, t0 FROM segment_box WHERE id = ?1");
  if (!query.Bind(id).Next()) {
    DSG_RETURN_IF_ERROR(query.status());
    return CorruptRow(db.map_name(), "segment_box", absl::StrCat(id));
  }
  const auto metres = [&](int column) { return static_cast<double>(query.Int(column)) / 1000.0; };
  SegmentBox box;
  box.box_map.extend(Eigen::Vector3d(metres(0), metres(2), metres(4)));
  box.box_map.extend(Eigen::Vector3d(metres(1), metres(3), metres(5)));
  box.t0 = spec.epoch_ns + query.Int(6) * (kNsPerSecond / 10);
  return box;
}

absl::Status WriteSegmentBox(Database& db, const MapSpec& spec, int64_t id, const SegmentBox& box) {
  const IntBox mm = ToMillimetres(box.box_map);
  return Query(db,
               "INSERT OR REPLACE INTO segment_box"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)")
      .Bind(id, mm.x0, mm.x1, mm.y0, mm.y1, mm.z0, mm.z1, ToTenthsFloor(box.t0, spec),
            ToTenthsCeil(box.t1, spec))
      .Run();
}

absl::Status ExtendSegmentBox(Database& db, const MapSpec& spec, int64_t id,
                              const StoredPose& before) {
  Box3d point_map;
  point_map.extend(PositionOf(before, spec.codec));
  const IntBox mm = ToMillimetres(point_map);
  return Query(db,
               "UPDATE segment_box SET x0 = min(x0, ?2), x1 = max(x1, ?3), y0 = min(y0, ?4),"
               " y1 = max(y1, ?5), z0 = min(z0, ?6), z1 = max(z1, ?7), t0 = min(t0, ?8)"
               " WHERE id = ?1")
      .Bind(id, mm.x0, mm.x1, mm.y0, mm.y1, mm.z0, mm.z1, ToTenthsFloor(before.time_ns, spec))
      .Run();
}

absl::StatusOr<StayRow> StayRowOf(const Query& query, const std::string& map) {
  const StayRow row{IdOf(query.Int(0)), query.Int(1),       query.Int(2),
                    IdOf(query.Int(3)), IdOf(query.Int(4)), query.Int(5)};
  if (query.Int(6) == ChecksumOf(row)) return row;
  return CorruptRow(map, "stay", absl::StrCat(ToString(row.agent), " ", row.enter_ns));
}

absl::StatusOr<std::vector<Stay>> ReadStaysIn(Database& db, NodeId room_or_place, TimeNs from_ns,
                                              TimeNs to_ns, Revision revision) {
  std::vector<Stay> stays;
  // Of those up to an hour none that entered earlier can reach from_ns; the longer ones have
  // indices of their own.
  const TimeNs enter_min = from_ns < kTimeMin + kStayNsMax ? kTimeMin : from_ns - kStayNsMax;
  for (const char* sql : {DSG_STAYS_IN("room"), DSG_STAYS_IN("place")}) {
    Query query(db, sql);
    query.Bind(KeyOf(room_or_place), enter_min, from_ns, to_ns, revision);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const StayRow row, StayRowOf(query, db.map_name()));
      stays.push_back(row.stay());
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return stays;
}

#undef DSG_STAY_COLUMNS
#undef DSG_SHORT_STAYS
#undef DSG_LONG_STAYS
#undef DSG_HOUR
#undef DSG_STAYS_IN

absl::Status WriteStays(const std::vector<Stay>& stays, CommitContext* commit) {
  for (const Stay& stay : stays) DSG_RETURN_IF_ERROR(WriteStay(stay, commit));
  return absl::OkStatus();
}

absl::Status EndStays(const std::vector<StayKey>& keys, CommitContext* commit) {
  for (const StayKey& key : keys) {
    Query current(commit->db, kSelectStay);
    const bool exists = current.Bind(KeyOf(key.agent), key.enter_ns).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (!exists) continue;
    DSG_ASSIGN_OR_RETURN(const StayRow row, StayRowOf(current, commit->spec.name));
    DSG_RETURN_IF_ERROR(EndStay(row, commit));
  }
  return absl::OkStatus();
}

absl::Status EndStaysOf(NodeId agent, CommitContext* commit) {
  std::vector<StayKey> keys;
  {
    Query query(commit->db, "SELECT enter_ns FROM stay WHERE agent = ?1");
    query.Bind(KeyOf(agent));
    while (query.Next()) keys.push_back({agent, query.Int(0)});
    DSG_RETURN_IF_ERROR(query.status());
  }
  return EndStays(keys, commit);
}

}  // namespace dsg::sqlite
