// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/track_cache.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/track_rules.h"

namespace dsg::sqlite {
namespace {

absl::Status LoadInfo(Database& db, const MapSpec& spec, Revision revision, NodeId agent,
                      Track* track) {
  Query query(db,
              "SELECT key, rev_from, layer, payload, checksum FROM node"
              " WHERE key = ?1 AND rev_from <= ?2"
              " UNION ALL SELECT key, rev_from, layer, payload, checksum FROM node_history"
              " WHERE key = ?1 AND rev_from <= ?2 AND rev_to > ?2");
  const bool found = query.Bind(KeyOf(agent), revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return UnknownAgent(spec.name, agent);
  DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, spec.name));
  if (!IsAgentKind(node.kind)) return UnknownAgent(spec.name, agent);
  track->info = TrackInfoOf(node, spec);
  return absl::OkStatus();
}

absl::Status LoadSegments(Database& db, Revision revision, int64_t slot, Track* track) {
  DSG_ASSIGN_OR_RETURN(const auto mark, FindMark(db, slot, revision));
  if (mark.has_value()) track->info.pose_count = mark->pose_count;
  const TimeNs end_ns = mark.has_value() ? mark->last_ns : kTimeMin;
  Query query(db,
              "SELECT id, rev_from, t0, t1, pose_count FROM trajectory_segment"
              " WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3"
              " UNION ALL SELECT id, rev_from, t0, t1, pose_count FROM trajectory_history"
              " WHERE id BETWEEN ?1 AND ?2 AND rev_from <= ?3 AND rev_to > ?3");
  query.Bind(FirstSegmentId(slot), LastSegmentId(slot), revision);
  while (query.Next()) {
    const SegmentRef segment{query.Int(0), query.Int(1), query.Int(2),
                             std::min(query.Int(3), end_ns), query.Int(4)};
    // Appended after this revision.
    if (segment.t0 > end_ns) continue;
    track->segments.push_back(segment);
  }
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(track->segments.begin(), track->segments.end(),
            [](const SegmentRef& a, const SegmentRef& b) { return a.id < b.id; });
  if (!track->segments.empty()) {
    track->info.first_ns = track->segments.front().t0;
    track->info.last_ns = end_ns;
  }
  return absl::OkStatus();
}

absl::Status LoadStays(Database& db, Revision revision, NodeId agent, Track* track) {
  Query query(db,
              "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum FROM stay"
              " WHERE agent = ?1 AND rev_from <= ?2"
              " UNION ALL SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum"
              " FROM stay_history WHERE agent = ?1 AND rev_from <= ?2 AND rev_to > ?2");
  query.Bind(KeyOf(agent), revision);
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const StayRow row, StayRowOf(query, db.map_name()));
    track->stays.push_back(row.stay());
  }
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(track->stays.begin(), track->stays.end(),
            [](const Stay& a, const Stay& b) { return a.enter_ns < b.enter_ns; });
  TimeNs end_ns = kTimeMin;
  for (const Stay& stay : track->stays) {
    track->stays_end_ns.push_back(end_ns = std::max(end_ns, stay.exit_ns));
  }
  return absl::OkStatus();
}

absl::Status LoadAll(Database& db, const MapSpec& spec, NodeId agent, Revision revision,
                     Track* track) {
  DSG_RETURN_IF_ERROR(LoadInfo(db, spec, revision, agent, track));
  DSG_ASSIGN_OR_RETURN(const int64_t slot, FindSlot(db, agent));
  if (slot != 0) DSG_RETURN_IF_ERROR(LoadSegments(db, revision, slot, track));
  return LoadStays(db, revision, agent, track);
}

}  // namespace

int Track::FindSegment(TimeNs t_ns) const {
  const auto next =
      std::upper_bound(segments.begin(), segments.end(), t_ns,
                       [](TimeNs t, const SegmentRef& segment) { return t < segment.t0; });
  return static_cast<int>(next - segments.begin()) - 1;
}

absl::StatusOr<TrackPtr> LoadTrack(Database& db, const MapSpec& spec, NodeId agent,
                                   Revision revision) {
  auto track = std::make_shared<Track>();
  DSG_RETURN_IF_ERROR(LoadAll(db, spec, agent, revision, track.get()));
  return TrackPtr(std::move(track));
}

absl::StatusOr<Revision> LastChangeOfTrack(Database& db, NodeId agent) {
  Query query(db,
              "SELECT max(rev) FROM ("
              " SELECT rev_from AS rev FROM node WHERE key = ?1"
              " UNION ALL SELECT max(revision) FROM track_mark"
              "  WHERE slot = (SELECT slot FROM track WHERE agent = ?1)"
              " UNION ALL SELECT max(rev_to) FROM stay_history WHERE agent = ?1"
              " UNION ALL SELECT max(rev_from) FROM stay WHERE agent = ?1)");
  query.Bind(KeyOf(agent));
  const bool found = query.Next() && !query.IsNull(0);
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : kRevisionMax;
}

absl::StatusOr<SegmentPtr> LoadSegment(Database& db, const SegmentRef& segment) {
  Query query(db, "SELECT " DSG_SEGMENT_COLUMNS
                  " FROM trajectory_segment WHERE id = ?1 AND rev_from = ?2"
                  " UNION ALL SELECT " DSG_SEGMENT_COLUMNS
                  " FROM trajectory_history WHERE id = ?1 AND rev_from = ?2");
  const bool found = query.Bind(segment.id, segment.rev_from).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (found) {
    DSG_ASSIGN_OR_RETURN(SegmentPtr reader, SegmentReaderOf(query, db.map_name()));
    if (reader->count() >= segment.pose_count) return reader;
  }
  return CorruptRow(db.map_name(), "trajectory_segment", absl::StrCat(segment.id));
}

}  // namespace dsg::sqlite
