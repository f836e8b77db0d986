// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/map_content.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr double kFloorReachM = 1.5;

HeightRange HeightsOf(const Node& node) {
  if (node.region.has_value() && node.region->z_max_m > node.region->z_min_m) {
    return {node.region->z_min_m, node.region->z_max_m};
  }
  const Box3d box = node.BoxMap();
  return {box.min().z(), box.max().z()};
}

HeightRange HeightsAround(const MapContent& content, double z_m) {
  HeightRange around{z_m, z_m};
  bool has_room = false;
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kRoom) continue;
    const HeightRange heights = HeightsOf(node);
    if (heights.high_m <= heights.low_m || !heights.Contains(z_m)) continue;
    around = {std::min(around.low_m, heights.low_m), std::max(around.high_m, heights.high_m)};
    has_room = true;
  }
  return has_room ? around : HeightRange{z_m - kFloorReachM, z_m + kFloorReachM};
}

// The floor of the room of each structure that has a room; of several the highest.
std::unordered_map<NodeId, double> RoomFloors(const MapContent& content) {
  const auto nodes = NodesById(content);
  std::unordered_map<NodeId, double> floors_m;
  for (const Edge& edge : content.edges) {
    const bool encloses = edge.relation == relations::kEncloses;
    if (!encloses && edge.relation != relations::kContains) continue;
    const Node& structure = *nodes.at(encloses ? edge.source : edge.target);
    const Node& room = *nodes.at(encloses ? edge.target : edge.source);
    if (structure.kind != kinds::kStructure || room.kind != kinds::kRoom) continue;
    const HeightRange heights = HeightsOf(room);
    // A room that is only a point says nothing of its floor.
    if (heights.high_m <= heights.low_m) continue;
    const auto [floor, is_first] = floors_m.emplace(structure.id, heights.low_m);
    if (!is_first) floor->second = std::max(floor->second, heights.low_m);
  }
  return floors_m;
}

std::vector<HeightRange> HeightsOfAll(const MapContent& content, const char* kind) {
  std::vector<HeightRange> heights;
  for (const Node& node : content.nodes) {
    if (node.kind == kind) heights.push_back(HeightsOf(node));
  }
  return heights;
}

// Whether what begins at a height belongs to these heights, and not to the storey above.
bool HoldsFoot(const HeightRange& heights, double foot_m) {
  constexpr double kErrorM = 0.2;
  return heights.low_m <= foot_m + kErrorM && foot_m < heights.high_m - kErrorM;
}

// The floor below the foot of a structure that has no room; the foot itself if nothing is around.
double FloorBelow(double foot_m, const std::vector<HeightRange>& rooms,
                  const std::vector<HeightRange>& structures) {
  double floor_m = std::numeric_limits<double>::lowest();
  bool has_room = false;
  for (const HeightRange& room : rooms) {
    if (!HoldsFoot(room, foot_m)) continue;
    floor_m = std::max(floor_m, room.low_m);
    has_room = true;
  }
  if (has_room) return floor_m;
  floor_m = foot_m;
  for (const HeightRange& structure : structures) {
    if (HoldsFoot(structure, foot_m)) floor_m = std::min(floor_m, structure.low_m);
  }
  return floor_m;
}

double MiddleHeight(const Node& node) {
  if (!node.region.has_value()) return MiddleOf(node).z();
  const HeightRange heights = HeightsOf(node);
  return 0.5 * (heights.low_m + heights.high_m);
}

Track TrackOn(const HeightRange& floor, const Track& track) {
  Track kept{.agent = track.agent, .pieces = {}};
  for (const std::vector<Eigen::Vector3d>& piece : track.pieces) {
    for (std::vector<Eigen::Vector3d>& part : PiecesOnFloor(floor, piece))
      kept.pieces.push_back(std::move(part));
  }
  return kept;
}

}  // namespace

std::string NameOf(const Node& node) { return node.name.empty() ? ToString(node.id) : node.name; }

std::unordered_map<NodeId, const Node*> NodesById(const MapContent& content) {
  std::unordered_map<NodeId, const Node*> nodes;
  nodes.reserve(content.nodes.size());
  for (const Node& node : content.nodes) nodes.emplace(node.id, &node);
  return nodes;
}

std::unordered_map<NodeId, const Node*> ParentsOf(const MapContent& content) {
  const auto nodes = NodesById(content);
  std::unordered_map<NodeId, const Node*> parents;
  for (const Edge& edge : content.edges) {
    if (edge.relation == relations::kContains) parents[edge.target] = nodes.at(edge.source);
  }
  return parents;
}

Eigen::Vector3d MiddleOf(const Node& node) {
  const bool has_middle = !node.box_node.isEmpty() && node.kind != kinds::kPlace;
  return has_middle ? node.map_T_node * node.box_node.center() : node.map_T_node.position;
}

bool HasBody(const MapContent& content, NodeId agent) {
  return std::any_of(content.bodies.begin(), content.bodies.end(),
                     [agent](const AgentBodies& bodies) { return bodies.agent == agent; });
}

const Eigen::Vector3d& LastOf(const Track& track) { return track.pieces.back().back(); }

HeightRange StandingHeights(const HeightRange& floor) {
  constexpr double kErrorM = 0.3;
  return {floor.low_m - kErrorM, floor.high_m};
}

std::vector<std::vector<Eigen::Vector3d>> PiecesOnFloor(const HeightRange& floor,
                                                        const std::vector<Eigen::Vector3d>& track) {
  std::vector<std::vector<Eigen::Vector3d>> pieces;
  bool is_inside = false;
  for (const Eigen::Vector3d& point : track) {
    const bool was_inside = is_inside;
    is_inside = StandingHeights(floor).Contains(point.z());
    if (is_inside && !was_inside) pieces.emplace_back();
    if (is_inside) pieces.back().push_back(point);
  }
  return pieces;
}

absl::StatusOr<HeightRange> ChooseFloor(const MapContent& content, const std::string& floor) {
  for (const Node& node : content.nodes) {
    if (ToString(node.id) == floor || node.name == floor) return HeightsOf(node);
  }
  double z_m = 0.0;
  if (absl::SimpleAtod(floor, &z_m) && std::isfinite(z_m)) {
    const HeightRange heights = HeightsAround(content, z_m);
    const auto is_there = [&](const Node& node) { return heights.Contains(MiddleHeight(node)); };
    if (content.nodes.empty() || std::ranges::any_of(content.nodes, is_there)) return heights;
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("--floor ", floor, ": the map has nothing between ", heights.low_m, " and ",
                     heights.high_m, " m; give a height of one of its floors, or a level or room"),
        {{"field", "--floor"}, {"value", floor}});
  }
  return MakeError(Reason::kNodeUnknown,
                   absl::StrCat("--floor \"", floor,
                                "\": no node has this id or name; give a level or room (dsg ls "
                                "--kind room) or a height in metres"),
                   {{"field", "--floor"}, {"value", floor}});
}

std::unordered_set<NodeId> StructuresOverHead(const MapContent& content) {
  constexpr double kHeadM = 1.8;
  const std::unordered_map<NodeId, double> room_floors_m = RoomFloors(content);
  const std::vector<HeightRange> rooms = HeightsOfAll(content, kinds::kRoom);
  const std::vector<HeightRange> structures = HeightsOfAll(content, kinds::kStructure);
  std::unordered_set<NodeId> over_head;
  for (const Node& node : content.nodes) {
    if (node.kind != kinds::kStructure || node.box_node.isEmpty()) continue;
    const double foot_m = node.BoxMap().min().z();
    const auto of_room = room_floors_m.find(node.id);
    const double floor_m =
        of_room == room_floors_m.end() ? FloorBelow(foot_m, rooms, structures) : of_room->second;
    if (foot_m - floor_m > kHeadM) over_head.insert(node.id);
  }
  return over_head;
}

void KeepFloor(const HeightRange& floor, MapContent* content) {
  std::unordered_set<NodeId> kept;
  for (const Track& track : content->tracks) kept.insert(track.agent);
  std::erase_if(content->nodes, [&](const Node& node) {
    if (kept.contains(node.id)) return false;
    if (!floor.Contains(MiddleHeight(node))) return true;
    kept.insert(node.id);
    return false;
  });
  std::erase_if(content->edges, [&](const Edge& edge) {
    return !kept.contains(edge.source) || !kept.contains(edge.target);
  });
  for (Track& track : content->tracks) track = TrackOn(floor, track);
  std::erase_if(content->tracks, [](const Track& track) { return track.pieces.empty(); });
  for (MeshBlock& block : content->mesh) {
    std::erase_if(block.faces, [&](const std::array<uint32_t, 3>& face) {
      return std::none_of(face.begin(), face.end(), [&](uint32_t vertex) {
        return floor.Contains(static_cast<double>(block.positions_map[vertex].z()));
      });
    });
  }
}

}  // namespace dsg::cli
