// SPDX-License-Identifier: Apache-2.0
// A snapshot of a map in memory. Each question looks at all that could answer it, with the map
// locked, and shows what it found once the map is free again: a visitor may ask the next question.
#include <algorithm>

#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/memory/memory_reader.h"
#include "schema/store/track_rules.h"

namespace dsg::memory {
namespace {

class MemorySnapshot : public Snapshot {
 public:
  MemorySnapshot(std::shared_ptr<const MapRows> rows, RevisionRecord record, int64_t generation,
                 uint64_t opening)
      : rows_(std::move(rows)),
        record_(std::move(record)),
        generation_(generation),
        opening_(opening) {}

  const MapSpec& spec() const override { return rows_->spec; }
  Revision revision() const override { return record_.info.revision; }
  uint64_t opening() const override { return opening_; }
  const std::string& incarnation() const override { return rows_->incarnation; }

  absl::StatusOr<std::vector<Layer>> Layers() const override;
  absl::StatusOr<std::vector<SemanticLabel>> Labels() const override;
  absl::StatusOr<MapStats> Stats() const override;

  absl::StatusOr<Node> GetNode(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> NodesNamed(const std::string& name) const override;
  absl::Status ScanNodes(const NodeFilter& filter, NodeId after, const StopCheck& stop,
                         const std::function<bool(const Node&)>& visit) const override;
  absl::Status ScanEdges(const EdgeFilter& filter, const std::optional<EdgeKey>& after,
                         const StopCheck& stop,
                         const std::function<bool(const Edge&)>& visit) const override;
  absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey& key) const override;
  absl::StatusOr<std::vector<std::optional<Node>>> FindNodes(const std::vector<NodeId>& ids,
                                                             const StopCheck& stop) const override;
  absl::StatusOr<std::vector<std::optional<Edge>>> FindEdges(const std::vector<EdgeKey>& keys,
                                                             const StopCheck& stop) const override;
  absl::Status ReadAllNodes(const StopCheck& stop,
                            const std::function<void(const Node&)>& visit) const override;
  absl::Status ReadAllEdges(const StopCheck& stop,
                            const std::function<void(const Edge&)>& visit) const override;
  absl::StatusOr<std::vector<NodeId>> Ancestors(NodeId id) const override;

  absl::StatusOr<std::vector<TrackInfo>> Tracks(const StopCheck& stop) const override;
  absl::StatusOr<TrackInfo> GetTrack(NodeId agent) const override;
  absl::StatusOr<LocatedPose> Locate(NodeId agent, TimeNs at_ns) const override;
  absl::Status ReadPoseRuns(
      NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
      const std::function<bool(absl::Span<const TimedPose>)>& visit) const override;
  absl::StatusOr<std::vector<BoxVisit>> VisitsToBox(const Box3d& box_map, TimeNs from_ns,
                                                    TimeNs to_ns,
                                                    const StopCheck& stop) const override;
  absl::StatusOr<int64_t> CountObservedAgents(TimeNs from_ns, TimeNs to_ns,
                                              const StopCheck& stop) const override;

  absl::StatusOr<std::optional<Stay>> StayAt(NodeId agent, TimeNs at_ns) const override;
  absl::StatusOr<std::vector<Stay>> StaysOfAgent(NodeId agent, TimeNs from_ns,
                                                 TimeNs to_ns) const override;
  absl::StatusOr<std::vector<Stay>> StaysInNode(NodeId room_or_place, TimeNs from_ns, TimeNs to_ns,
                                                const StopCheck& stop) const override;

  absl::StatusOr<std::vector<PoseFactor>> Factors(NodeId agent, TimeNs from_ns,
                                                  TimeNs to_ns) const override;
  absl::Status ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns, bool with_vertices,
                          const StopCheck& stop,
                          const std::function<bool(const ShownShape&)>& visit) const override;
  absl::StatusOr<std::vector<BlockIndex>> MeshBlocks() const override;
  absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> MeshBlockVersions(
      const StopCheck& stop) const override;
  absl::StatusOr<MeshBlock> ReadMeshBlock(BlockIndex index) const override;
  absl::StatusOr<Asset> ReadAsset(const Sha256& sha256) const override;

 private:
  /// Runs `ask` with the map locked, if the revision can still be read.
  template <typename Ask>
  auto Locked(const Ask& ask) const -> decltype(ask()) {
    const std::lock_guard lock(rows_->mutex);
    if (rows_->generation != generation_) return RewrittenError(spec().name);
    DSG_RETURN_IF_ERROR(
        CheckReadable(spec().name, revision(), rows_->newest(), rows_->ReadableNow()));
    return ask();
  }

  absl::StatusOr<std::vector<Node>> NodesWhere(
      const std::function<bool(const Node&)>& matches) const;
  absl::StatusOr<std::vector<Edge>> EdgesWhere(
      const std::function<bool(const Edge&)>& matches) const;
  absl::StatusOr<std::vector<NodeId>> Agents() const;
  absl::StatusOr<TrackInfo> InfoOf(NodeId agent) const;
  /// Of any agent, also one that has no node: none.
  absl::StatusOr<std::vector<StoredPose>> PosesOf(NodeId agent) const;
  absl::StatusOr<std::vector<Stay>> StaysWhere(
      const std::function<bool(const Stay&)>& matches) const;

  const std::shared_ptr<const MapRows> rows_;
  const RevisionRecord record_;
  const int64_t generation_;
  const uint64_t opening_;
};

// Shows things one after the other, until the visitor or the caller has enough.
template <typename T, typename Visit>
absl::Status ShowAll(const std::vector<T>& things, const StopCheck& stop, const Visit& visit) {
  DSG_RETURN_IF_ERROR(AskStop(stop));
  for (const T& thing : things) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    if (!visit(thing)) break;
  }
  return absl::OkStatus();
}

absl::Status CorruptPayload(const std::string& map, const std::string& what) {
  return MakeError(Reason::kStoreCorrupt,
                   "map \"" + map + "\": " + what + " in memory cannot be decoded", {{"map", map}});
}

absl::StatusOr<std::vector<Layer>> MemorySnapshot::Layers() const {
  return Locked(
      [&]() -> absl::StatusOr<std::vector<Layer>> { return rows_->LayersAt(revision()); });
}

absl::StatusOr<std::vector<SemanticLabel>> MemorySnapshot::Labels() const {
  return Locked([&]() -> absl::StatusOr<std::vector<SemanticLabel>> {
    std::map<int32_t, std::string> newest;
    for (const auto& [from, label] : rows_->labels) {
      if (from <= revision()) newest[label.id] = label.name;
    }
    std::vector<SemanticLabel> labels;
    for (const auto& [id, name] : newest) labels.push_back({id, name});
    return labels;
  });
}

absl::StatusOr<MapStats> MemorySnapshot::Stats() const {
  DSG_ASSIGN_OR_RETURN(const auto layers, Layers());
  return StatsOf(record_, layers);
}

absl::StatusOr<std::vector<Node>> MemorySnapshot::NodesWhere(
    const std::function<bool(const Node&)>& matches) const {
  return Locked([&]() -> absl::StatusOr<std::vector<Node>> {
    std::vector<Node> nodes;
    rows_->nodes.ForEachAt(revision(), [&](NodeId, const auto& version) {
      if (matches(version.value.node)) nodes.push_back(version.value.node);
    });
    return nodes;
  });
}

absl::StatusOr<std::vector<Edge>> MemorySnapshot::EdgesWhere(
    const std::function<bool(const Edge&)>& matches) const {
  return Locked([&]() -> absl::StatusOr<std::vector<Edge>> {
    std::vector<Edge> edges;
    rows_->edges.ForEachAt(revision(), [&](const EdgeKey&, const auto& version) {
      if (matches(version.value.edge)) edges.push_back(version.value.edge);
    });
    return edges;
  });
}

absl::StatusOr<Node> MemorySnapshot::GetNode(NodeId id) const {
  return Locked([&]() -> absl::StatusOr<Node> {
    auto node = rows_->NodeAt(id, revision());
    if (node.has_value()) return *std::move(node);
    return UnknownNode(id);
  });
}

absl::StatusOr<std::vector<NodeId>> MemorySnapshot::NodesNamed(const std::string& name) const {
  DSG_ASSIGN_OR_RETURN(const auto nodes, NodesWhere([&](const Node& node) {
                         return !name.empty() && node.name == name;
                       }));
  std::vector<NodeId> ids;
  for (const Node& node : nodes) ids.push_back(node.id);
  return ids;
}

absl::Status MemorySnapshot::ScanNodes(const NodeFilter& filter, NodeId after,
                                       const StopCheck& stop,
                                       const std::function<bool(const Node&)>& visit) const {
  const auto is_child = [&](const Node& node) {
    return filter.parent.empty() ||
           rows_->edges.Find({filter.parent, relations::kContains, node.id}, revision()) != nullptr;
  };
  DSG_ASSIGN_OR_RETURN(const auto nodes, NodesWhere([&](const Node& node) {
                         return after < node.id && filter.Matches(node) && is_child(node);
                       }));
  return ShowAll(nodes, stop, visit);
}

absl::Status MemorySnapshot::ScanEdges(const EdgeFilter& filter,
                                       const std::optional<EdgeKey>& after, const StopCheck& stop,
                                       const std::function<bool(const Edge&)>& visit) const {
  DSG_ASSIGN_OR_RETURN(const auto edges, EdgesWhere([&](const Edge& edge) {
                         return filter.Matches(edge) && (!after || *after < edge.key());
                       }));
  return ShowAll(edges, stop, visit);
}

absl::StatusOr<std::optional<Edge>> MemorySnapshot::FindEdge(const EdgeKey& key) const {
  return Locked([&]() -> absl::StatusOr<std::optional<Edge>> {
    const auto* const version = rows_->edges.Find(key, revision());
    if (version == nullptr) return std::optional<Edge>();
    return std::optional<Edge>(version->value.edge);
  });
}

absl::StatusOr<std::vector<std::optional<Node>>> MemorySnapshot::FindNodes(
    const std::vector<NodeId>& ids, const StopCheck& stop) const {
  return Locked([&]() -> absl::StatusOr<std::vector<std::optional<Node>>> {
    std::vector<std::optional<Node>> nodes;
    for (const NodeId id : ids) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      nodes.push_back(rows_->NodeAt(id, revision()));
    }
    return nodes;
  });
}

absl::StatusOr<std::vector<std::optional<Edge>>> MemorySnapshot::FindEdges(
    const std::vector<EdgeKey>& keys, const StopCheck& stop) const {
  std::vector<std::optional<Edge>> edges;
  for (const EdgeKey& key : keys) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(auto edge, FindEdge(key));
    edges.push_back(std::move(edge));
  }
  return edges;
}

absl::Status MemorySnapshot::ReadAllNodes(const StopCheck& stop,
                                          const std::function<void(const Node&)>& visit) const {
  return ScanNodes({}, NodeId(), stop, [&](const Node& node) {
    visit(node);
    return true;
  });
}

absl::Status MemorySnapshot::ReadAllEdges(const StopCheck& stop,
                                          const std::function<void(const Edge&)>& visit) const {
  return ScanEdges({}, std::nullopt, stop, [&](const Edge& edge) {
    visit(edge);
    return true;
  });
}

absl::StatusOr<std::vector<NodeId>> MemorySnapshot::Ancestors(NodeId id) const {
  std::vector<NodeId> ancestors;
  // Ranks grow from child to parent, so the chain ends.
  for (NodeId at = id;;) {
    EdgeFilter to_child;
    to_child.relation = relations::kContains;
    to_child.target = at;
    DSG_ASSIGN_OR_RETURN(const auto edges,
                         EdgesWhere([&](const Edge& edge) { return to_child.Matches(edge); }));
    if (edges.empty()) return ancestors;
    // They ascend by source.
    ancestors.push_back(at = edges.front().source);
  }
}

absl::StatusOr<std::vector<NodeId>> MemorySnapshot::Agents() const {
  DSG_ASSIGN_OR_RETURN(const auto nodes,
                       NodesWhere([](const Node& node) { return IsAgentKind(node.kind); }));
  std::vector<NodeId> ids;
  for (const Node& node : nodes) ids.push_back(node.id);
  return ids;
}

absl::StatusOr<TrackInfo> MemorySnapshot::InfoOf(NodeId agent) const {
  return Locked([&]() -> absl::StatusOr<TrackInfo> {
    auto info = rows_->TrackInfoAt(agent, revision());
    if (info.has_value()) return *std::move(info);
    return UnknownAgent(spec().name, agent);
  });
}

absl::StatusOr<std::vector<StoredPose>> MemorySnapshot::PosesOf(NodeId agent) const {
  return Locked([&]() -> absl::StatusOr<std::vector<StoredPose>> {
    std::vector<StoredPose> poses;
    const auto track = rows_->tracks.find(agent);
    if (track == rows_->tracks.end()) return poses;
    track->second.ForEachAt(
        revision(), [&](TimeNs, const Track::Version& version) { poses.push_back(version.value); });
    return poses;
  });
}

absl::StatusOr<std::vector<TrackInfo>> MemorySnapshot::Tracks(const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto agents, Agents());
  std::vector<TrackInfo> tracks;
  for (const NodeId agent : agents) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(TrackInfo info, InfoOf(agent));
    tracks.push_back(std::move(info));
  }
  return tracks;
}

absl::StatusOr<TrackInfo> MemorySnapshot::GetTrack(NodeId agent) const { return InfoOf(agent); }

absl::StatusOr<LocatedPose> MemorySnapshot::Locate(NodeId agent, TimeNs at_ns) const {
  DSG_ASSIGN_OR_RETURN(const TrackInfo info, InfoOf(agent));
  DSG_RETURN_IF_ERROR(CheckInTrack(info, at_ns));
  DSG_ASSIGN_OR_RETURN(const auto poses, PosesOf(agent));
  const auto after = std::partition_point(
      poses.begin(), poses.end(), [&](const StoredPose& pose) { return pose.time_ns <= at_ns; });
  const StoredPose& before = *(after - 1);
  return LocateBetween(before, after == poses.end() ? before : *after, at_ns, info.gap_ns_max,
                       spec().codec);
}

absl::Status MemorySnapshot::ReadPoseRuns(
    NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
    const std::function<bool(absl::Span<const TimedPose>)>& visit) const {
  DSG_RETURN_IF_ERROR(InfoOf(agent).status());
  DSG_ASSIGN_OR_RETURN(auto poses, PosesOf(agent));
  std::erase_if(poses, [&](const StoredPose& pose) {
    return pose.time_ns < from_ns || pose.time_ns >= to_ns;
  });
  return ShowAll(poses, stop, [&](const StoredPose& stored) {
    const TimedPose pose = FromStored(stored, spec().codec);
    return visit(absl::MakeConstSpan(&pose, 1));
  });
}

absl::StatusOr<std::vector<BoxVisit>> MemorySnapshot::VisitsToBox(const Box3d& box_map,
                                                                  TimeNs from_ns, TimeNs to_ns,
                                                                  const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto agents, Agents());
  std::vector<BoxVisit> visits;
  for (const NodeId agent : agents) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const TrackInfo info, InfoOf(agent));
    DSG_ASSIGN_OR_RETURN(const auto poses, PosesOf(agent));
    std::vector<TimedPosition> positions;
    for (const StoredPose& pose : poses) {
      positions.push_back({pose.time_ns, PositionOf(pose, spec().codec)});
    }
    CollectVisits(agent, positions, info.gap_ns_max, box_map, from_ns, to_ns, &visits);
  }
  SortVisits(&visits);
  return visits;
}

absl::StatusOr<int64_t> MemorySnapshot::CountObservedAgents(TimeNs from_ns, TimeNs to_ns,
                                                            const StopCheck& stop) const {
  DSG_ASSIGN_OR_RETURN(const auto agents, Agents());
  int64_t count = 0;
  for (const NodeId agent : agents) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const TrackInfo info, InfoOf(agent));
    DSG_ASSIGN_OR_RETURN(const auto poses, PosesOf(agent));
    const auto next = std::partition_point(
        poses.begin(), poses.end(), [&](const StoredPose& pose) { return pose.time_ns < to_ns; });
    if (next == poses.begin()) continue;
    const TimeNs last_ns = (next - 1)->time_ns;
    const bool is_joined = next != poses.end() && next->time_ns - last_ns <= info.gap_ns_max;
    if ((is_joined ? next->time_ns : last_ns) >= from_ns) ++count;
  }
  return count;
}

absl::StatusOr<std::vector<Stay>> MemorySnapshot::StaysWhere(
    const std::function<bool(const Stay&)>& matches) const {
  return Locked([&]() -> absl::StatusOr<std::vector<Stay>> {
    std::vector<Stay> stays;
    rows_->stays.ForEachAt(revision(), [&](const StayKey&, const auto& version) {
      if (!matches(version.value)) return;
      const auto info = rows_->TrackInfoAt(version.value.agent, revision());
      stays.push_back(info.has_value() ? ClipToTrack(version.value, *info) : version.value);
    });
    return stays;
  });
}

absl::StatusOr<std::optional<Stay>> MemorySnapshot::StayAt(NodeId agent, TimeNs at_ns) const {
  DSG_RETURN_IF_ERROR(InfoOf(agent).status());
  DSG_ASSIGN_OR_RETURN(const auto stays,
                       StaysWhere([&](const Stay& stay) { return stay.agent == agent; }));
  // A long stay may hold shorter ones, which are over; the last that began counts.
  for (auto stay = stays.rbegin(); stay != stays.rend(); ++stay) {
    if (stay->enter_ns <= at_ns && at_ns < stay->exit_ns) return std::optional<Stay>(*stay);
  }
  return std::optional<Stay>();
}

absl::StatusOr<std::vector<Stay>> MemorySnapshot::StaysOfAgent(NodeId agent, TimeNs from_ns,
                                                               TimeNs to_ns) const {
  DSG_RETURN_IF_ERROR(InfoOf(agent).status());
  DSG_ASSIGN_OR_RETURN(auto stays,
                       StaysWhere([&](const Stay& stay) { return stay.agent == agent; }));
  std::erase_if(
      stays, [&](const Stay& stay) { return stay.enter_ns >= to_ns || stay.exit_ns <= from_ns; });
  return stays;
}

absl::StatusOr<std::vector<Stay>> MemorySnapshot::StaysInNode(NodeId room_or_place, TimeNs from_ns,
                                                              TimeNs to_ns,
                                                              const StopCheck& stop) const {
  DSG_RETURN_IF_ERROR(AskStop(stop));
  DSG_ASSIGN_OR_RETURN(auto stays, StaysWhere([&](const Stay& stay) {
                         return stay.room == room_or_place || stay.place == room_or_place;
                       }));
  std::erase_if(
      stays, [&](const Stay& stay) { return stay.enter_ns >= to_ns || stay.exit_ns <= from_ns; });
  SortStays(&stays);
  return stays;
}

absl::StatusOr<std::vector<PoseFactor>> MemorySnapshot::Factors(NodeId agent, TimeNs from_ns,
                                                                TimeNs to_ns) const {
  return Locked([&]() -> absl::StatusOr<std::vector<PoseFactor>> {
    std::vector<PoseFactor> factors;
    bool is_sound = true;
    rows_->factors.ForEachAt(revision(), [&](int64_t, const Batches::Version& version) {
      if (version.value.agent != agent) return;
      std::vector<PoseFactor> batch;
      is_sound = is_sound && DecodeFactors(version.value.payload, &batch);
      for (PoseFactor& factor : batch) {
        if (factor.from_ns < to_ns && factor.to_ns >= from_ns) factors.push_back(factor);
      }
    });
    if (!is_sound) return CorruptPayload(spec().name, "factors of " + ToString(agent));
    SortFactors(&factors);
    return factors;
  });
}

absl::Status MemorySnapshot::ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns,
                                        bool with_vertices, const StopCheck& stop,
                                        const std::function<bool(const ShownShape&)>& visit) const {
  struct Believed {
    Revision from = 0;
    BodyShape shape;
    uint32_t vertex_count = 0;
    std::optional<Sha256> topology;
  };
  std::map<TimeNs, Believed> by_time;
  DSG_RETURN_IF_ERROR(Locked([&]() -> absl::Status {
    bool is_sound = true;
    rows_->shapes.ForEachAt(revision(), [&](int64_t, const Batches::Version& version) {
      if (version.value.agent != agent) return;
      DecodedShapes decoded;
      is_sound = is_sound && DecodeShapes(version.value.payload, with_vertices, &decoded);
      for (size_t i = 0; is_sound && i < decoded.shapes.size(); ++i) {
        const TimeNs time_ns = decoded.shapes[i].time_ns;
        if (time_ns < from_ns || time_ns >= to_ns) continue;
        // Batches come in the order in which they were written.
        Believed& believed = by_time[time_ns];
        if (believed.from > version.from) continue;
        believed = {version.from, decoded.shapes[i], decoded.vertex_counts[i], decoded.topology};
      }
    });
    if (!is_sound) return CorruptPayload(spec().name, "shapes of " + ToString(agent));
    return absl::OkStatus();
  }));
  std::vector<Believed> shown;
  for (auto& [time_ns, believed] : by_time) shown.push_back(std::move(believed));
  return ShowAll(shown, stop, [&](const Believed& one) {
    return visit({one.shape, one.vertex_count, one.topology});
  });
}

absl::StatusOr<std::vector<BlockIndex>> MemorySnapshot::MeshBlocks() const {
  DSG_ASSIGN_OR_RETURN(const auto versions, MeshBlockVersions(StopCheck()));
  std::vector<BlockIndex> blocks;
  for (const auto& [index, written] : versions) blocks.push_back(index);
  return blocks;
}

absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> MemorySnapshot::MeshBlockVersions(
    const StopCheck& stop) const {
  DSG_RETURN_IF_ERROR(AskStop(stop));
  return Locked([&]() -> absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> {
    std::vector<std::pair<BlockIndex, Revision>> blocks;
    rows_->mesh_blocks.ForEachAt(revision(), [&](const BlockIndex& index, const auto& version) {
      blocks.emplace_back(index, version.from);
    });
    return blocks;
  });
}

absl::StatusOr<MeshBlock> MemorySnapshot::ReadMeshBlock(BlockIndex index) const {
  return Locked([&]() -> absl::StatusOr<MeshBlock> {
    const auto* const version = rows_->mesh_blocks.Find(index, revision());
    if (version == nullptr) return UnknownMeshBlock(index);
    MeshBlock block;
    if (!DecodeMeshBlock(version->value, &block))
      return CorruptPayload(spec().name, "a mesh block");
    return block;
  });
}

absl::StatusOr<Asset> MemorySnapshot::ReadAsset(const Sha256& sha256) const {
  return Locked([&]() -> absl::StatusOr<Asset> {
    const auto found = rows_->assets.find(sha256);
    if (found == rows_->assets.end() || found->second.from > revision()) {
      return UnknownAsset(sha256);
    }
    return Asset{sha256, found->second.media_type, found->second.content};
  });
}

}  // namespace

std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<const MapRows> rows,
                                             RevisionRecord record, int64_t generation,
                                             uint64_t opening) {
  return std::make_shared<const MemorySnapshot>(std::move(rows), std::move(record), generation,
                                                opening);
}

}  // namespace dsg::memory
