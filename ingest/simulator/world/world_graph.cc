// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/world_graph.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "ingest/simulator/world/catalogue.h"

namespace dsg::simulator {
namespace {

Node MakeNode(NodeId id, LayerId layer, const char* kind, const std::string& name,
              const std::string& class_name) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  node.name = name;
  if (!class_name.empty()) {
    node.class_id = ClassId(class_name);
    node.class_name = class_name;
  }
  node.provenance = Provenance::kManual;
  return node;
}

Polygon2d Corners(const Rect& rect) {
  return {rect.min(), Point(rect.max().x(), rect.min().y()), rect.max(),
          Point(rect.min().x(), rect.max().y())};
}

/// On the floor in the middle of `rect`, upright to the ceiling.
Node RegionNode(Node node, const Rect& rect, double height) {
  const Point middle = rect.center();
  const Point half = 0.5 * rect.sizes();
  node.map_T_node.position = Eigen::Vector3d(middle.x(), middle.y(), 0.0);
  node.box_node = Box3d(Eigen::Vector3d(-half.x(), -half.y(), 0.0),
                        Eigen::Vector3d(half.x(), half.y(), height));
  node.region = RegionInfo{Corners(rect), 0.0, height, {}};
  return node;
}

Node ObjectNode(const Furniture& item, int index) {
  Node node =
      MakeNode(ObjectId(index), layers::kObjects, kinds::kObject, item.name, item.class_name);
  node.map_T_node.position = item.center;
  const double half_yaw = 0.25 * std::numbers::pi * item.quarter_turns;
  node.map_T_node.orientation =
      Eigen::Quaterniond(std::cos(half_yaw), 0.0, 0.0, std::sin(half_yaw));
  node.box_node = Box3d(-0.5 * item.size, 0.5 * item.size);
  node.object.emplace();
  node.object->color = item.color;
  node.object->size = item.size;
  return node;
}

Node PlaceNode(const Place& place, int index) {
  Node node = MakeNode(PlaceId(index), layers::kPlaces, kinds::kPlace, "", "");
  node.map_T_node.position = Eigen::Vector3d(place.position.x(), place.position.y(), 0.0);
  // A point, so that the box over the objects of a place holds the place too.
  node.box_node = Box3d(Eigen::Vector3d::Zero().eval());
  node.place.emplace();
  node.place->clearance_m = place.clearance_m;
  // The square in the clear circle; doors are lower than rooms.
  const double half = place.clearance_m / std::numbers::sqrt2;
  node.place->free_box =
      Box3d(Eigen::Vector3d(-half, -half, 0.0), Eigen::Vector3d(half, half, kDoorHeightM));
  if (place.door >= 0) node.attributes["doorway"] = true;
  return node;
}

Node StructureNode(const Structure& part, const FloorPlan& plan, int index) {
  Node node = MakeNode(StructureId(index), layers::kStructures, kinds::kStructure,
                       part.type + " of " + plan.rooms[part.room].name, part.type);
  const Point middle = part.rect.center();
  const Point size = part.rect.sizes();
  const double height = part.z_max_m - part.z_min_m;
  node.map_T_node.position =
      Eigen::Vector3d(middle.x(), middle.y(), 0.5 * (part.z_min_m + part.z_max_m));
  const Eigen::Vector3d half(0.5 * size.x(), 0.5 * size.y(), 0.5 * height);
  node.box_node = Box3d(-half, half);
  node.structure = StructureInfo{part.type, part.normal, part.offset_m, 0};
  return node;
}

void AddEdge(NodeId source, const char* relation, NodeId target, double weight, GraphDelta* delta) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  edge.weight = weight;
  delta->edges.push_back(std::move(edge));
}

int NearestPlace(const World& world, const Furniture& item) {
  int nearest = -1;
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < world.places.places.size(); ++i) {
    const Place& place = world.places.places[i];
    if (place.room != item.room) continue;
    const double squared = (place.position - item.center.head<2>()).squaredNorm();
    if (squared < nearest_squared) {
      nearest_squared = squared;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

void AddRegions(const World& world, GraphDelta* delta) {
  const FloorPlan& plan = world.plan;
  const std::string building_class = plan.building_name + " building";
  delta->nodes.push_back(RegionNode(MakeNode(BuildingId(), layers::kBuildings, kinds::kBuilding,
                                             plan.building_name, building_class),
                                    world.Bounds(), plan.ceiling_m));
  for (int i = 0; i < static_cast<int>(plan.rooms.size()); ++i) {
    const Room& room = plan.rooms[i];
    delta->nodes.push_back(
        RegionNode(MakeNode(RoomId(i), layers::kRooms, kinds::kRoom, room.name, room.class_name),
                   room.cell, room.ceiling_m));
    AddEdge(BuildingId(), relations::kContains, RoomId(i), 1.0, delta);
  }
  for (const Door& door : plan.doors) {
    AddEdge(RoomId(door.room_a), relations::kAdjacent, RoomId(door.room_b), door.width_m, delta);
  }
  for (int i = 0; i < static_cast<int>(plan.structures.size()); ++i) {
    const Structure& part = plan.structures[i];
    delta->nodes.push_back(StructureNode(part, plan, i));
    AddEdge(StructureId(i), relations::kEncloses, RoomId(part.room), 1.0, delta);
  }
}

void AddPlaces(const World& world, GraphDelta* delta) {
  for (int i = 0; i < static_cast<int>(world.places.places.size()); ++i) {
    delta->nodes.push_back(PlaceNode(world.places.places[i], i));
    AddEdge(RoomId(world.places.places[i].room), relations::kContains, PlaceId(i), 1.0, delta);
  }
  for (const PlaceEdge& edge : world.places.edges) {
    AddEdge(PlaceId(edge.from), relations::kTraversable, PlaceId(edge.to), edge.clearance_m, delta);
  }
}

void AddObjects(const World& world, GraphDelta* delta) {
  for (int i = 0; i < static_cast<int>(world.furniture.size()); ++i) {
    const Furniture& item = world.furniture[i];
    delta->nodes.push_back(ObjectNode(item, i));
    AddEdge(PlaceId(NearestPlace(world, item)), relations::kContains, ObjectId(i), 1.0, delta);
    if (item.on >= 0) AddEdge(ObjectId(i), relations::kOn, ObjectId(item.on), 1.0, delta);
  }
}

}  // namespace

GraphDelta WorldGraph(const World& world) {
  GraphDelta delta;
  delta.author = "dsg-simulate";
  delta.message = "generated " + world.plan.building_name;
  delta.layers = DefaultLayers();
  delta.labels = Labels();
  AddRegions(world, &delta);
  AddPlaces(world, &delta);
  AddObjects(world, &delta);
  FitBoxesToChildren(&delta);
  return delta;
}

}  // namespace dsg::simulator
