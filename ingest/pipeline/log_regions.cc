// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_regions.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool IsRoom(const Node& node) { return node.layer == layers::kRooms; }
bool IsPlace(const Node& node) { return node.layer == layers::kPlaces; }

}  // namespace

absl::StatusOr<LogRegions> LogRegions::Read(const MapView& map,
                                            const std::optional<NodeNumbering>& own) {
  LogRegions regions;
  DSG_ASSIGN_OR_RETURN(regions.rooms_, map.NodesOfLayer(layers::kRooms));
  DSG_ASSIGN_OR_RETURN(regions.places_, map.NodesOfLayer(layers::kPlaces));
  if (own.has_value()) {
    const auto is_own = [&own](const Node& node) { return own->IsOwn(node.id); };
    std::erase_if(regions.rooms_, is_own);
    std::erase_if(regions.places_, is_own);
  }
  for (const Node& room : regions.rooms_) {
    DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> children, map.Children(room.id));
    for (const NodeId child : children) regions.contains_.push_back({room.id, child});
  }
  return regions;
}

void LogRegions::Add(const GraphDelta& graph) {
  std::unordered_set<NodeId> replaced;
  for (const Node& node : graph.nodes) {
    if (IsRoom(node) || IsPlace(node)) replaced.insert(node.id);
  }
  const auto is_replaced = [&replaced](const Node& node) { return replaced.contains(node.id); };
  std::erase_if(rooms_, is_replaced);
  std::erase_if(places_, is_replaced);
  for (const Node& node : graph.nodes) {
    if (IsRoom(node)) rooms_.push_back(node);
    if (IsPlace(node)) places_.push_back(node);
  }
  for (const Edge& edge : graph.edges) {
    if (edge.relation == relations::kContains) contains_.push_back({edge.source, edge.target});
  }
}

RegionIndex LogRegions::MakeIndex() const {
  std::vector<Node> rooms = rooms_;
  std::vector<Node> places = places_;
  for (const Node& node : found_.nodes) {
    if (IsRoom(node)) rooms.push_back(node);
    if (IsPlace(node)) places.push_back(node);
  }
  // What has left the world holds nobody any more.
  const auto has_ended = [](const Node& node) { return node.valid.to_ns != kTimeMax; };
  std::erase_if(rooms, has_ended);
  std::erase_if(places, has_ended);
  std::vector<RegionIndex::Containment> contains = contains_;
  for (const Edge& edge : found_.edges) contains.push_back({edge.source, edge.target});
  std::sort(contains.begin(), contains.end(),
            [](const RegionIndex::Containment& a, const RegionIndex::Containment& b) {
              return std::pair(a.room, a.place) < std::pair(b.room, b.place);
            });
  return RegionIndex(std::move(rooms), std::move(places), contains);
}

}  // namespace dsg::ingest
