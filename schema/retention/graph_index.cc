// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/graph_index.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/known_names.h"

namespace dsg {
namespace {

std::optional<Sha256> AssetOf(const Node& node) {
  if (node.object.has_value() && node.object->model) return node.object->model;
  if (node.agent.has_value()) return node.agent->body_model;
  return std::nullopt;
}

}  // namespace

std::optional<Solid> SpaceOf(const Node& node) {
  if (node.kind != kinds::kRoom) return std::nullopt;
  const bool has_plan = node.region.has_value() && node.region->footprint_map.size() >= 3;
  // Without a floor plan it is the room's box.
  if (!has_plan) {
    if (node.box_node.isEmpty()) return std::nullopt;
    return Solid{node.BoxMap(), {}};
  }
  Solid solid;
  solid.footprint_map = node.region->footprint_map;
  double z_min = node.region->z_min_m;
  double z_max = node.region->z_max_m;
  if (!(z_min < z_max)) {
    // The height is unknown: that of the box, or all.
    const Box3d box = node.box_node.isEmpty() ? Box3d() : node.BoxMap();
    z_min = box.isEmpty() ? -std::numeric_limits<double>::max() : box.min().z();
    z_max = box.isEmpty() ? std::numeric_limits<double>::max() : box.max().z();
  }
  for (const Eigen::Vector2d& corner : solid.footprint_map) {
    solid.box_map.extend(Eigen::Vector3d(corner.x(), corner.y(), z_min));
    solid.box_map.extend(Eigen::Vector3d(corner.x(), corner.y(), z_max));
  }
  return solid;
}

void GraphIndex::Add(const Node& node) {
  IndexedNode made;
  made.id = node.id;
  made.layer = node.layer;
  made.is_agent = IsAgentKind(node.kind);
  made.is_pose = node.kind == kAgentPoseKind;
  made.may_hold_stays = node.kind == kinds::kRoom || node.kind == kinds::kPlace;
  made.position_map = node.map_T_node.position;
  made.valid_to_ns = node.valid.to_ns;
  made.last_observed_ns = node.last_observed_ns;
  made.byte_count = static_cast<int32_t>(EncodeNodePayload(node).size());
  if (const auto asset = AssetOf(node)) {
    made.asset = static_cast<int32_t>(assets_.size());
    assets_.push_back(*asset);
  }
  if (auto space = SpaceOf(node)) {
    made.solid = static_cast<int32_t>(solids_.size());
    solids_.push_back(*std::move(space));
  }
  nodes_.push_back(made);
}

absl::Status GraphIndex::LoadNodes(const Snapshot& map, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(map.ReadAllNodes(stop, [this](const Node& node) { Add(node); }));
  std::sort(nodes_.begin(), nodes_.end(),
            [](const IndexedNode& a, const IndexedNode& b) { return a.id < b.id; });
  // One that a commit replaced meanwhile was shown twice.
  const auto same = [](const IndexedNode& a, const IndexedNode& b) { return a.id == b.id; };
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end(), same), nodes_.end());
  return absl::OkStatus();
}

absl::Status GraphIndex::LoadHierarchy(const Snapshot& map, const StopCheck& stop) {
  children_.resize(nodes_.size());
  parents_.resize(nodes_.size());
  DSG_RETURN_IF_ERROR(map.ReadAllEdges(stop, [this](const Edge& edge) {
    if (edge.relation != relations::kContains) return;
    const int64_t parent = Find(edge.source);
    const int64_t child = Find(edge.target);
    if (parent < 0 || child < 0) return;
    children_[static_cast<size_t>(parent)].push_back(static_cast<uint32_t>(child));
    parents_[static_cast<size_t>(child)].push_back(static_cast<uint32_t>(parent));
  }));
  for (auto* lists : {&children_, &parents_}) {
    for (auto& list : *lists) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }
  return absl::OkStatus();
}

absl::Status GraphIndex::SortByRank(const Snapshot& map) {
  DSG_ASSIGN_OR_RETURN(const std::vector<Layer> layers, map.Layers());
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : layers) rank_of[layer.id] = layer.rank;
  bottom_up_.resize(nodes_.size());
  for (uint32_t i = 0; i < bottom_up_.size(); ++i) bottom_up_[i] = i;
  std::stable_sort(bottom_up_.begin(), bottom_up_.end(), [&](uint32_t a, uint32_t b) {
    return rank_of[nodes_[a].layer] < rank_of[nodes_[b].layer];
  });
  return absl::OkStatus();
}

absl::StatusOr<GraphIndex> GraphIndex::Load(const Snapshot& map, const StopCheck& stop) {
  GraphIndex index;
  DSG_RETURN_IF_ERROR(index.LoadNodes(map, stop));
  DSG_RETURN_IF_ERROR(index.LoadHierarchy(map, stop));
  DSG_RETURN_IF_ERROR(index.SortByRank(map));
  DSG_ASSIGN_OR_RETURN(index.tracks_, map.Tracks(stop));
  return index;
}

int64_t GraphIndex::Find(NodeId id) const {
  const auto at =
      std::lower_bound(nodes_.begin(), nodes_.end(), id,
                       [](const IndexedNode& node, NodeId wanted) { return node.id < wanted; });
  return at == nodes_.end() || at->id != id ? -1 : at - nodes_.begin();
}

}  // namespace dsg
