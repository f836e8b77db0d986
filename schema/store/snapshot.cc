// SPDX-License-Identifier: Apache-2.0
#include "schema/store/snapshot.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"

namespace dsg {

bool NodeFilter::Matches(const Node& node) const {
  return (!layer.has_value() || node.layer == *layer) && (kind.empty() || node.kind == kind) &&
         (class_name.empty() || node.class_name == class_name) &&
         (name.empty() || node.name == name) &&
         (!at_ns.has_value() || node.valid.Contains(*at_ns)) &&
         (!box_map.has_value() || node.BoxMap().intersects(*box_map));
}

absl::StatusOr<std::vector<BodyShape>> Snapshot::Shapes(NodeId agent, TimeNs from_ns,
                                                        TimeNs to_ns) const {
  std::vector<BodyShape> shapes;
  DSG_RETURN_IF_ERROR(ReadShapes(agent, from_ns, to_ns, /*with_vertices=*/true, StopCheck(),
                                 [&](const ShownShape& shown) {
                                   shapes.push_back(shown.shape);
                                   return true;
                                 }));
  return shapes;
}

absl::Status Snapshot::ReadPoses(NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
                                 const std::function<bool(const TimedPose&)>& visit) const {
  return ReadPoseRuns(agent, from_ns, to_ns, stop, [&](absl::Span<const TimedPose> poses) {
    return std::all_of(poses.begin(), poses.end(), std::cref(visit));
  });
}

bool EdgeFilter::Matches(const Edge& edge) const {
  return (relation.empty() || edge.relation == relation) &&
         (source.empty() || edge.source == source) && (target.empty() || edge.target == target) &&
         (!at_ns.has_value() || edge.valid.Contains(*at_ns));
}

absl::StatusOr<Layer> Snapshot::FindLayer(std::string_view name) const {
  DSG_ASSIGN_OR_RETURN(const auto layers, Layers());
  std::vector<std::string> names;
  for (const Layer& layer : layers) {
    if (layer.name == name) return layer;
    names.push_back(layer.name);
  }
  return MakeError(Reason::kLayerUnknown,
                   absl::StrCat("map \"", spec().name, "\" has no layer \"", std::string(name),
                                "\"; it has ", absl::StrJoin(names, ", ")),
                   {{"map", spec().name}, {"layer", std::string(name)}});
}

absl::StatusOr<NodeId> Snapshot::ResolveNode(std::string_view id_or_name) const {
  const auto id = ParseNodeId(id_or_name);
  if (id.ok()) {
    const auto node = GetNode(*id);
    if (node.ok()) return *id;
    if (!absl::IsNotFound(node.status())) return node.status();
  }
  DSG_ASSIGN_OR_RETURN(const auto ids, NodesNamed(std::string(id_or_name)));
  if (!ids.empty()) return ids.front();
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("no node of map \"", spec().name, "\" has the id or name \"",
                                std::string(id_or_name), "\" at revision ", revision()),
                   {{"map", spec().name}, {"node", std::string(id_or_name)}});
}

absl::StatusOr<bool> Snapshot::IsAgent(NodeId id) const {
  const auto track = GetTrack(id);
  if (absl::IsNotFound(track.status())) return false;
  DSG_RETURN_IF_ERROR(track.status());
  return true;
}

absl::StatusOr<NodeId> Snapshot::ResolveAgent(std::string_view id_or_name) const {
  if (const auto id = ParseNodeId(id_or_name); id.ok()) {
    DSG_ASSIGN_OR_RETURN(const bool found, IsAgent(*id));
    if (found) return *id;
  }
  DSG_ASSIGN_OR_RETURN(const auto named, NodesNamed(std::string(id_or_name)));
  std::vector<NodeId> agents;
  for (const NodeId id : named) {
    DSG_ASSIGN_OR_RETURN(const bool found, IsAgent(id));
    if (found) agents.push_back(id);
  }
  if (agents.size() == 1) return agents.front();
  if (agents.size() > 1) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("several agents of map \"", spec().name, "\" are named \"",
                                  std::string(id_or_name), "\", ", ToString(agents[0]), " and ",
                                  ToString(agents[1]), " among them; ask by id"),
                     {{"map", spec().name}, {"agent", std::string(id_or_name)}});
  }
  return MakeError(Reason::kAgentUnknown,
                   absl::StrCat("no agent of map \"", spec().name, "\" has the id or name \"",
                                std::string(id_or_name), "\" at revision ", revision(),
                                "; `dsg ls --layer agents` lists the known ones"),
                   {{"map", spec().name}, {"agent", std::string(id_or_name)}});
}

absl::Status Snapshot::UnknownNode(NodeId id) const {
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("node ", ToString(id), " is unknown in map \"", spec().name,
                                "\" at revision ", revision()),
                   {{"map", spec().name}, {"node", ToString(id)}});
}

absl::Status Snapshot::UnknownMeshBlock(const BlockIndex& index) const {
  const std::string key = absl::StrCat(index.x, ",", index.y, ",", index.z);
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("map \"", spec().name, "\" has no mesh block ", key),
                   {{"map", spec().name}, {"block", key}});
}

absl::Status Snapshot::UnknownAsset(const Sha256& sha256) const {
  return MakeError(Reason::kAssetUnknown,
                   absl::StrCat("map \"", spec().name, "\" has no asset ", ToHex(sha256)),
                   {{"map", spec().name}, {"asset", ToHex(sha256)}});
}

absl::StatusOr<AssetPart> Snapshot::ReadAssetPart(const Sha256& sha256, int64_t index) const {
  DSG_ASSIGN_OR_RETURN(const Asset asset, ReadAsset(sha256));
  const size_t size = asset.content.size();
  AssetPart part;
  part.media_type = asset.media_type;
  part.size_bytes = static_cast<int64_t>(size);
  part.part_count =
      static_cast<int64_t>(std::max<size_t>(1, (size + kAssetPartBytes - 1) / kAssetPartBytes));
  if (index < 0 || index >= part.part_count) {
    return MakeError(Reason::kAssetUnknown,
                     absl::StrCat("asset ", ToHex(sha256), " has ", part.part_count,
                                  " parts and no part ", index, "; ask for one of these"),
                     {{"asset", ToHex(sha256)}});
  }
  part.content =
      asset.content.substr(static_cast<size_t>(index) * kAssetPartBytes, kAssetPartBytes);
  return part;
}

}  // namespace dsg
