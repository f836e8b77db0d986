// SPDX-License-Identifier: Apache-2.0
// All of a snapshot but nodes and edges: snapshot_graph.cc.
#include "schema/store/sqlite/snapshot.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/track_rules.h"

namespace dsg::sqlite {
namespace {

absl::Status CorruptSegment(const std::string& map, const SegmentRef& segment) {
  return CorruptRow(map, "trajectory_segment", absl::StrCat(segment.id));
}

}  // namespace

std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<SqliteMapReader> reader,
                                             std::shared_ptr<const RevisionRecord> head) {
  return std::make_shared<const SqliteSnapshot>(std::move(reader), std::move(head));
}

absl::StatusOr<std::vector<Layer>> SqliteSnapshot::Layers() const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease, "SELECT id, name, rank FROM layer WHERE rev_from <= ?1 ORDER BY rank, name");
  query.Bind(revision());
  std::vector<Layer> layers;
  while (query.Next()) {
    layers.push_back({static_cast<LayerId>(query.Int(0)), std::string(query.Text(1)),
                      static_cast<int32_t>(query.Int(2))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return layers;
}

absl::StatusOr<std::vector<SemanticLabel>> SqliteSnapshot::Labels() const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT id, name, max(rev_from) FROM label WHERE rev_from <= ?1"
              " GROUP BY id ORDER BY id");
  query.Bind(revision());
  std::vector<SemanticLabel> labels;
  while (query.Next()) {
    labels.push_back({static_cast<int32_t>(query.Int(0)), std::string(query.Text(1))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return labels;
}

absl::StatusOr<MapStats> SqliteSnapshot::Stats() const {
  DSG_ASSIGN_OR_RETURN(const auto layers, Layers());
  MapStats stats = StatsOf(*head_, layers);
  stats.bytes_on_disk = reader_->bytes_on_disk();
  return stats;
}

// Kept by the reader: over the years there are far more agents than in the minute asked about.
absl::StatusOr<NodeIdsPtr> SqliteSnapshot::AgentIds(const StopCheck& stop) const {
  return reader_->agents().Get(revision(), stop, [&]() -> absl::StatusOr<Costed<NodeIdsPtr>> {
    auto ids = std::make_shared<std::vector<NodeId>>();
    NodeFilter filter;
    filter.layer = layers::kAgents;
    DSG_RETURN_IF_ERROR(ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
      if (IsAgentKind(node.kind)) ids->push_back(node.id);
      return true;
    }));
    const size_t bytes = sizeof(NodeId) * ids->capacity();
    return Costed<NodeIdsPtr>{std::move(ids), bytes};
  });
}

absl::StatusOr<std::vector<TrackInfo>> SqliteSnapshot::Tracks(const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto ids, AgentIds(stop));
  std::vector<TrackInfo> tracks;
  for (const NodeId id : *ids) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(id, revision()));
    tracks.push_back(track->info);
  }
  return tracks;
}

absl::StatusOr<TrackInfo> SqliteSnapshot::GetTrack(NodeId agent) const {
  DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(agent, revision()));
  return track->info;
}

absl::StatusOr<LocatedPose> SqliteSnapshot::Locate(NodeId agent, TimeNs at_ns) const {
  DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(agent, revision()));
  const TrackInfo& info = track->info;
  DSG_RETURN_IF_ERROR(CheckInTrack(info, at_ns));
  const auto at = static_cast<size_t>(track->FindSegment(at_ns));
  const SegmentRef& segment = track->segments[at];
  DSG_ASSIGN_OR_RETURN(const auto reader, reader_->GetSegment(segment, revision()));
  int index = 0;
  StoredPose before;
  StoredPose after;
  if (!reader->FindBracket(at_ns, &index, &before, &after) || index < 0) {
    return CorruptSegment(spec().name, segment);
  }
  // Only the pose of that very instant needs no other.
  if (before.time_ns == at_ns) {
    return LocateBetween(before, before, at_ns, info.gap_ns_max, spec().codec);
  }
  // Past the segment's last pose, visible or stored, the next one begins the next segment.
  if (before.time_ns >= segment.t1 || index + 1 >= reader->count()) {
    if (at + 1 >= track->segments.size()) return CorruptSegment(spec().name, segment);
    const SegmentRef& next = track->segments[at + 1];
    DSG_ASSIGN_OR_RETURN(const auto next_reader, reader_->GetSegment(next, revision()));
    StoredPose unused;
    if (!next_reader->FindBracket(next.t0, &index, &after, &unused) || index < 0) {
      return CorruptSegment(spec().name, next);
    }
  }
  return LocateBetween(before, after, at_ns, info.gap_ns_max, spec().codec);
}

absl::Status SqliteSnapshot::ReadPoseRuns(
    NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
    const std::function<bool(absl::Span<const TimedPose>)>& visit) const {
  DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(agent, revision()));
  const int first = std::max(track->FindSegment(from_ns), 0);
  std::vector<TimedPose> poses;
  for (auto i = static_cast<size_t>(first); i < track->segments.size(); ++i) {
    const SegmentRef& segment = track->segments[i];
    if (segment.t0 >= to_ns) break;
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto reader, reader_->GetSegment(segment, revision()));
    if (!reader->DecodePoses(&poses)) return CorruptSegment(spec().name, segment);
    const auto first_not_before = [&poses](TimeNs time_ns) {
      return std::partition_point(poses.begin(), poses.end(),
                                  [=](const TimedPose& pose) { return pose.time_ns < time_ns; });
    };
    // Poses appended after this revision stand at the end.
    const TimeNs end_ns = segment.t1 < to_ns ? segment.t1 + 1 : to_ns;
    const auto begin = first_not_before(from_ns);
    const auto end = first_not_before(end_ns);
    if (begin >= end) continue;
    if (!visit(absl::MakeConstSpan(&*begin, static_cast<size_t>(end - begin)))) break;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::map<NodeId, std::vector<int64_t>>> SqliteSnapshot::SegmentsTouching(
    const Box3d& box_map, TimeNs from_ns, TimeNs to_ns) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  constexpr double kLimit = 2.1e6;
  const IntBox box = ToMillimetres(Box3d(box_map.min().cwiseMax(-kLimit).cwiseMin(kLimit),
                                         box_map.max().cwiseMax(-kLimit).cwiseMin(kLimit)));
  // Segments that were corrected after this revision are in no index; they are few, and all are
  // candidates.
  Query query(*lease,
              "SELECT agent, id FROM ("
              " SELECT id FROM segment_box WHERE x1 >= ?1 AND x0 <= ?2 AND y1 >= ?3"
              "  AND y0 <= ?4 AND z1 >= ?5 AND z0 <= ?6 AND t1 >= ?7 AND t0 <= ?8"
              " UNION ALL SELECT id FROM trajectory_history"
              "  WHERE rev_to > ?9 AND +rev_from <= ?9)"
              " JOIN track ON slot = id >> 42");
  query.Bind(box.x0, box.x1, box.y0, box.y1, box.z0, box.z1, ToTenthsFloor(from_ns, spec()),
             ToTenthsFloor(to_ns, spec()) + 1, revision());
  std::map<NodeId, std::vector<int64_t>> segments_of;
  while (query.Next()) segments_of[IdOf(query.Int(0))].push_back(query.Int(1));
  DSG_RETURN_IF_ERROR(query.status());
  for (auto& [agent, ids] : segments_of) std::sort(ids.begin(), ids.end());
  return segments_of;
}

absl::Status SqliteSnapshot::PositionsAround(const Track& track, size_t segment, TimeNs from_ns,
                                             TimeNs to_ns,
                                             std::vector<TimedPosition>* positions) const {
  if (segment > 0) {
    // The way from the pose before belongs to this segment's box.
    const SegmentRef& previous = track.segments[segment - 1];
    DSG_ASSIGN_OR_RETURN(const auto reader, reader_->GetSegment(previous, revision()));
    int index = 0;
    StoredPose last;
    StoredPose unused;
    if (!reader->FindBracket(previous.t1, &index, &last, &unused) || index < 0) {
      return CorruptSegment(spec().name, previous);
    }
    positions->push_back({last.time_ns, PositionOf(last, spec().codec)});
  }
  const SegmentRef& ref = track.segments[segment];
  DSG_ASSIGN_OR_RETURN(const auto reader, reader_->GetSegment(ref, revision()));
  const size_t before = positions->size();
  if (!reader->DecodePositions(from_ns, to_ns, positions)) {
    return CorruptSegment(spec().name, ref);
  }
  // Poses appended after this revision stand at the end.
  while (positions->size() > before && positions->back().time_ns > ref.t1) positions->pop_back();
  // Left-out blocks stand between: the pose before must not be joined to what follows them.
  if (before > 0 && positions->size() > before && (*positions)[before].time_ns != ref.t0) {
    positions->erase(positions->begin());
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<BoxVisit>> SqliteSnapshot::VisitsToBox(const Box3d& box_map,
                                                                  TimeNs from_ns, TimeNs to_ns,
                                                                  const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto segments_of, SegmentsTouching(box_map, from_ns, to_ns));
  std::vector<BoxVisit> visits;
  std::vector<TimedPosition> positions;
  for (const auto& [agent, ids] : segments_of) {
    const auto found = reader_->GetTrack(agent, revision());
    // The agent may be newer than this revision.
    if (absl::IsNotFound(found.status())) continue;
    DSG_RETURN_IF_ERROR(found.status());
    const Track& track = **found;
    for (const int64_t id : ids) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      // Segments ascend in time, and so do their ids.
      const auto at = std::lower_bound(
          track.segments.begin(), track.segments.end(), id,
          [](const SegmentRef& segment, int64_t wanted) { return segment.id < wanted; });
      if (at == track.segments.end() || at->id != id) continue;
      positions.clear();
      DSG_RETURN_IF_ERROR(PositionsAround(track, static_cast<size_t>(at - track.segments.begin()),
                                          from_ns, to_ns, &positions));
      CollectVisits(agent, positions, track.info.gap_ns_max, box_map, from_ns, to_ns, &visits);
    }
  }
  SortVisits(&visits);
  return visits;
}

absl::StatusOr<int64_t> SqliteSnapshot::CountObservedAgents(TimeNs from_ns, TimeNs to_ns,
                                                            const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto ids, AgentIds(stop));
  int64_t count = 0;
  for (const NodeId id : *ids) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(id, revision()));
    const auto& segments = track->segments;
    const auto next =
        std::partition_point(segments.begin(), segments.end(),
                             [&](const SegmentRef& segment) { return segment.t0 < to_ns; });
    if (next == segments.begin()) continue;
    // Of those that begin in time the last is seen longest: from its first to its last pose, and on
    // to the next segment unless that is a gap.
    const SegmentRef& last = *(next - 1);
    const bool joined = next != segments.end() && next->t0 - last.t1 <= track->info.gap_ns_max;
    if ((joined ? next->t0 : last.t1) >= from_ns) ++count;
  }
  return count;
}

absl::StatusOr<std::optional<Stay>> SqliteSnapshot::StayAt(NodeId agent, TimeNs at_ns) const {
  DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(agent, revision()));
  const auto next = std::upper_bound(track->stays.begin(), track->stays.end(), at_ns,
                                     [](TimeNs t, const Stay& stay) { return t < stay.enter_ns; });
  // A long stay may hold shorter ones, which are over; the last that began counts.
  for (size_t i = static_cast<size_t>(next - track->stays.begin()); i-- > 0;) {
    const Stay stay = ClipToTrack(track->stays[i], track->info);
    if (at_ns < stay.exit_ns) return std::optional<Stay>(stay);
    if (track->stays_end_ns[i] <= at_ns) break;
  }
  return std::optional<Stay>();
}

absl::StatusOr<std::vector<Stay>> SqliteSnapshot::StaysOfAgent(NodeId agent, TimeNs from_ns,
                                                               TimeNs to_ns) const {
  DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(agent, revision()));
  std::vector<Stay> stays;
  for (const Stay& stored : track->stays) {
    const Stay stay = ClipToTrack(stored, track->info);
    if (stay.enter_ns < to_ns && stay.exit_ns > from_ns) stays.push_back(stay);
  }
  return stays;
}

absl::StatusOr<std::vector<Stay>> SqliteSnapshot::StaysInNode(NodeId room_or_place, TimeNs from_ns,
                                                              TimeNs to_ns,
                                                              const StopCheck& stop) const {
  std::vector<Stay> stays;
  {
    DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
    DSG_ASSIGN_OR_RETURN(stays, ReadStaysIn(*lease, room_or_place, from_ns, to_ns, revision()));
  }
  std::vector<Stay> touching;
  for (const Stay& stored : stays) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    Stay stay = stored;
    if (stay.exit_ns == kTimeMax) {
      DSG_ASSIGN_OR_RETURN(const auto track, reader_->GetTrack(stay.agent, revision()));
      stay = ClipToTrack(stay, track->info);
    }
    if (stay.exit_ns > from_ns) touching.push_back(stay);
  }
  SortStays(&touching);
  return touching;
}

absl::StatusOr<std::vector<PoseFactor>> SqliteSnapshot::Factors(NodeId agent, TimeNs from_ns,
                                                                TimeNs to_ns) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  Query query(*lease,
              "SELECT agent, rev_from, t0, t1, payload, checksum FROM factor_segment"
              " WHERE agent = ?1 AND rev_from <= ?2 AND t0 < ?4 AND t1 >= ?3"
              " UNION ALL SELECT agent, rev_from, t0, t1, payload, checksum FROM factor_history"
              " WHERE agent = ?1 AND rev_from <= ?2 AND rev_to > ?2 AND t0 < ?4 AND t1 >= ?3");
  query.Bind(KeyOf(agent), revision(), from_ns, to_ns);
  std::vector<PoseFactor> factors;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const auto row, BatchRowOf<FactorRow>(query, spec().name));
    std::vector<PoseFactor> batch;
    if (!DecodeFactors(row.payload, &batch)) {
      return CorruptRow(spec().name, "factor_segment", ToString(agent));
    }
    for (PoseFactor& factor : batch) {
      if (factor.from_ns < to_ns && factor.to_ns >= from_ns) factors.push_back(std::move(factor));
    }
  }
  DSG_RETURN_IF_ERROR(query.status());
  SortFactors(&factors);
  return factors;
}

absl::Status SqliteSnapshot::ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns,
                                        bool with_vertices, const StopCheck& stop,
                                        const std::function<bool(const ShownShape&)>& visit) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  const ShapeQuestion question{agent, revision(), from_ns, to_ns, with_vertices};
  return ShapeReader(*lease, &reader_->shapes(), question).Read(stop, visit);
}

absl::StatusOr<std::vector<BlockIndex>> SqliteSnapshot::MeshBlocks() const {
  DSG_ASSIGN_OR_RETURN(const auto versions, MeshBlockVersions(StopCheck()));
  std::vector<BlockIndex> blocks;
  blocks.reserve(versions.size());
  for (const auto& [index, written] : versions) blocks.push_back(index);
  return blocks;
}

absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> SqliteSnapshot::MeshBlockVersions(
    const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  return ReadMeshVersions(*lease, revision(), stop);
}

absl::StatusOr<MeshBlock> SqliteSnapshot::ReadMeshBlock(BlockIndex index) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  DSG_ASSIGN_OR_RETURN(auto block, FindMeshBlock(*lease, index, revision()));
  if (!block.has_value()) return UnknownMeshBlock(index);
  return *std::move(block);
}

absl::StatusOr<Asset> SqliteSnapshot::ReadAsset(const Sha256& sha256) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  DSG_ASSIGN_OR_RETURN(auto asset, FindAsset(*lease, sha256, revision()));
  if (!asset.has_value()) return UnknownAsset(sha256);
  return *std::move(asset);
}

absl::StatusOr<AssetPart> SqliteSnapshot::ReadAssetPart(const Sha256& sha256, int64_t index) const {
  DSG_ASSIGN_OR_RETURN(auto lease, reader_->LeaseAt(revision()));
  DSG_ASSIGN_OR_RETURN(auto part, FindAssetPart(*lease, sha256, index, revision()));
  if (part.has_value()) return *std::move(part);
  return MakeError(Reason::kAssetUnknown,
                   absl::StrCat("map \"", spec().name, "\" has no asset ", ToHex(sha256),
                                index == 0 ? "" : absl::StrCat(" with a part ", index)),
                   {{"map", spec().name}, {"asset", ToHex(sha256)}});
}

}  // namespace dsg::sqlite
