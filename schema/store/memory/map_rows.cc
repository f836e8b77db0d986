// SPDX-License-Identifier: Apache-2.0
#include "schema/store/memory/map_rows.h"

#include <algorithm>
#include <atomic>

#include "absl/strings/str_cat.h"
#include "schema/base/time.h"
#include "schema/store/track_rules.h"

namespace dsg::memory {
namespace {

// Tells maps of this process apart, and most likely those of others.
std::string NewIncarnation() {
  static std::atomic<uint64_t> count{0};
  return absl::StrCat("memory-", absl::Hex(WallClockNs()), "-", ++count);
}

// Adds a row to the changes at both ends of its life.
template <typename Row>
void AddChange(const Row& row, Revision to, std::map<Revision, RowSums>* changes) {
  (*changes)[row.rev_from].Add(row);
  if (to != kRevisionMax) (*changes)[to].Remove(row);
}

}  // namespace

MapRows::MapRows(MapSpec map_spec) : spec(std::move(map_spec)), incarnation(NewIncarnation()) {
  for (const Layer& layer : DefaultLayers()) layers.emplace_back(0, layer);
}

MapRows::MapRows(MapSpec map_spec, std::string incarnation_kept, MapContent content)
    : MapContent(std::move(content)),
      spec(std::move(map_spec)),
      incarnation(std::move(incarnation_kept)) {}

RevisionRecord MapRows::Head() const {
  return commits.empty() ? RevisionRecord() : commits.rbegin()->second.record;
}

Readable MapRows::ReadableNow() const {
  Readable readable;
  readable.oldest = oldest;
  readable.generation = generation;
  std::set<Revision> tagged;
  for (const auto& [name, tag] : tags) tagged.insert(tag.revision);
  readable.tagged.assign(tagged.begin(), tagged.end());
  return readable;
}

absl::StatusOr<int64_t> MapRows::FindRelation(const std::string& name) const {
  const auto found = relations.find(name);
  return found == relations.end() ? 0 : found->second;
}

std::optional<Node> MapRows::NodeAt(NodeId id, Revision revision) const {
  const auto* const version = nodes.Find(id, revision);
  return version == nullptr ? std::nullopt : std::optional<Node>(version->value.node);
}

std::vector<Layer> MapRows::LayersAt(Revision revision) const {
  std::vector<Layer> shown;
  for (const auto& [from, layer] : layers) {
    if (from <= revision) shown.push_back(layer);
  }
  std::sort(shown.begin(), shown.end(), [](const Layer& a, const Layer& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.name < b.name;
  });
  return shown;
}

std::optional<Interval> MapRows::SpanOf(const Track& track, Revision revision) {
  std::optional<Interval> span;
  track.ForEachAt(revision, [&](TimeNs time_ns, const Track::Version&) {
    if (!span.has_value()) span = Interval{time_ns, time_ns};
    span->to_ns = time_ns;
  });
  return span;
}

std::optional<Interval> MapRows::SpanOfAll(Revision revision) const {
  std::optional<Interval> all;
  for (const auto& [agent, track] : tracks) {
    const auto span = SpanOf(track, revision);
    if (!span.has_value()) continue;
    if (!all.has_value()) all = span;
    all->from_ns = std::min(all->from_ns, span->from_ns);
    all->to_ns = std::max(all->to_ns, span->to_ns);
  }
  return all;
}

std::optional<TrackInfo> MapRows::TrackInfoAt(NodeId agent, Revision revision) const {
  const auto node = NodeAt(agent, revision);
  if (!node.has_value() || !IsAgentKind(node->kind)) return std::nullopt;
  TrackInfo info = TrackInfoOf(*node, spec);
  const auto found = tracks.find(agent);
  if (found == tracks.end()) return info;
  found->second.ForEachAt(revision, [&](TimeNs time_ns, const Track::Version&) {
    if (info.pose_count++ == 0) info.first_ns = time_ns;
    info.last_ns = time_ns;
  });
  return info;
}

PendingErasure MapRows::CountPending() const {
  EraseList all = pending_erasure;
  for (const NotedErasure& noted : noted_erasures) all.Add(noted.list);
  return CountsOf(all);
}

std::map<Revision, RowSums> MapRows::SumChanges() const {
  std::map<Revision, RowSums> changes;
  for (const auto& [from, layer] : layers) {
    if (from > 0)
      AddChange(LayerRow{layer.id, layer.rank, from, layer.name}, kRevisionMax, &changes);
  }
  for (const auto& [from, label] : labels) {
    AddChange(LabelRow{label.id, from, label.name}, kRevisionMax, &changes);
  }
  nodes.ForEach([&](NodeId, const auto& node) { AddChange(RowOf(node), node.to, &changes); });
  edges.ForEach(
      [&](const EdgeKey&, const auto& edge) { AddChange(RowOf(edge), edge.to, &changes); });
  stays.ForEach(
      [&](const StayKey&, const auto& stay) { AddChange(RowOf(stay), stay.to, &changes); });
  mesh_blocks.ForEach([&](const BlockIndex& index, const auto& block) {
    AddChange(RowOf(index, block), block.to, &changes);
  });
  factors.ForEach([&](int64_t, const Batches::Version& batch) {
    AddChange(BatchRowOf<FactorRow>(batch), batch.to, &changes);
  });
  shapes.ForEach([&](int64_t, const Batches::Version& batch) {
    AddChange(BatchRowOf<ShapeRow>(batch), batch.to, &changes);
  });
  std::string scratch;
  for (const auto& [agent, track] : tracks) {
    track.ForEach([&, agent = agent](TimeNs, const Track::Version& pose) {
      const auto identity = PoseIdentity(agent, pose.value, spec.codec, &scratch);
      changes[pose.from].AddPose(identity);
      if (!pose.is_current()) changes[pose.to].RemovePose(identity);
    });
  }
  for (const auto& [sha256, asset] : assets) {
    AddChange(AssetRow{asset.from, BytesOf(sha256)}, kRevisionMax, &changes);
  }
  for (const auto& [from, sha256] : dropped_assets) {
    AddChange(AssetRow{from, BytesOf(sha256)}, kRevisionMax, &changes);
  }
  return changes;
}

NodeRow RowOf(const Versions<NodeId, StoredNode>::Version& version) {
  const Node& node = version.value.node;
  return {node.id, version.from, node.layer, version.value.payload, IsAgentKind(node.kind)};
}

EdgeRow RowOf(const Versions<EdgeKey, StoredEdge>::Version& version) {
  const Edge& edge = version.value.edge;
  return {edge.source, version.value.relation, edge.target, version.from,
          edge.weight, version.value.payload};
}

StayRow RowOf(const Versions<StayKey, Stay>::Version& version) {
  const Stay& stay = version.value;
  return {stay.agent, stay.enter_ns, stay.exit_ns, stay.place, stay.room, version.from};
}

MeshRow RowOf(const BlockIndex& index, const Versions<BlockIndex, std::string>::Version& version) {
  return {index, version.from, version.value};
}

}  // namespace dsg::memory
