// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/layer_graph.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/rooms/room_class.h"

namespace dsg::ingest {
namespace {

constexpr char kObjectLetter = 'O';
constexpr char kPlaceLetter = 'p';
constexpr char kStructureLetter = 'S';
constexpr char kRoomLetter = 'R';
constexpr char kLevelLetter = 'L';
constexpr char kBuildingLetter = 'B';

Box3d BoxAround(const Box3d& box_map, const Eigen::Vector3d& position_map) {
  return Box3d(box_map.min() - position_map, box_map.max() - position_map);
}

Polygon2d Corners(const Box3d& box) {
  return {{box.min().x(), box.min().y()},
          {box.max().x(), box.min().y()},
          {box.max().x(), box.max().y()},
          {box.min().x(), box.max().y()}};
}

Box3d BoxOf(const FoundRoom& room) {
  Box3d box;
  for (const Eigen::Vector2d& corner : room.footprint_map) {
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), room.z_min_m));
    box.extend(Eigen::Vector3d(corner.x(), corner.y(), room.z_max_m));
  }
  return box;
}

std::string MethodName(RoomMethod method) {
  switch (method) {
    case RoomMethod::kCeiling:
      return "ceiling section";
    case RoomMethod::kFiltration:
      return "place graph filtration";
    case RoomMethod::kPaper:
      return "section of the distance field";
    case RoomMethod::kAuto:
    case RoomMethod::kClearance:
      break;
  }
  return "narrow ways";
}

std::string ClassOf(PlaceKind kind) {
  switch (kind) {
    case PlaceKind::kStairs:
      return "stairs";
    case PlaceKind::kRamp:
      return "ramp";
    case PlaceKind::kLift:
      return "lift";
    case PlaceKind::kFloor:
      break;
  }
  return "";
}

}  // namespace

Layer LevelLayer() { return {kLevelLayer, "levels", 450}; }

LayerGraphMaker::LayerGraphMaker(NodeNumbering numbering, const std::vector<SemanticLabel>& labels,
                                 const std::vector<CadModel>& catalogue)
    : numbering_(std::move(numbering)), catalogue_(catalogue) {
  for (const SemanticLabel& label : labels) name_of_class_[label.id] = label.name;
}

std::string LayerGraphMaker::ClassName(int32_t class_id) const {
  const auto named = name_of_class_.find(class_id);
  return named != name_of_class_.end() ? named->second : absl::StrCat("class ", class_id);
}

// One graph in the making.
class LayerGraphMaker::Build {
 public:
  Build(const LayerGraphMaker& maker, const LayerParts& parts) : maker_(maker), parts_(parts) {}

  LayerGraph Take() && {
    for (size_t i = 0; i < parts_.objects.size(); ++i) {
      const auto fit = parts_.fits.find(parts_.objects[i].id);
      AddObject(parts_.objects[i], fit == parts_.fits.end() ? nullptr : &fit->second, kTimeMax,
                parts_.place_of_object[i]);
    }
    for (size_t i = 0; i < parts_.gone.size(); ++i) {
      const GoneObject& gone = parts_.gone[i];
      AddObject(gone.object, gone.fit.has_value() ? &*gone.fit : nullptr, gone.gone_ns,
                parts_.place_of_object[parts_.objects.size() + i]);
    }
    AddRelations();
    AddPlaces();
    AddStructures();
    AddRooms();
    if (!delta_.nodes.empty()) AddBuilding();
    FitBoxesToChildren(&delta_);
    return {std::move(delta_.nodes), std::move(delta_.edges)};
  }

 private:
  NodeId Id(char letter, int64_t index) const { return maker_.numbering_.Id(letter, index); }
  NodeId PlaceId(int index) const { return Id(kPlaceLetter, parts_.places.places[index].id); }
  NodeId RoomId(int index) const { return Id(kRoomLetter, parts_.rooms[index].room.id); }
  NodeId StructureId(int index) const { return Id(kStructureLetter, parts_.structures[index].id); }

  static Node MakeNode(NodeId id, LayerId layer, const char* kind) {
    Node node;
    node.id = id;
    node.layer = layer;
    node.kind = kind;
    node.provenance = Provenance::kPerceived;
    return node;
  }

  Edge& AddEdge(NodeId source, const char* relation, NodeId target, double weight) {
    Edge& edge = delta_.edges.emplace_back();
    edge.source = source;
    edge.relation = relation;
    edge.target = target;
    edge.weight = weight;
    return edge;
  }

  void AddObject(const TrackedObject& object, const ShapeFit* fit, TimeNs until_ns, int place) {
    const ObjectCluster& cluster = object.cluster;
    Node node = MakeNode(Id(kObjectLetter, object.id), layers::kObjects, kinds::kObject);
    node.class_id = cluster.class_id;
    node.class_name = maker_.ClassName(cluster.class_id);
    node.map_T_node = cluster.map_T_box;
    node.box_node = Box3d(-0.5 * cluster.size, 0.5 * cluster.size);
    if (cluster.is_at_centroid) {
      node.map_T_node.position = cluster.centroid_map;
      node.box_node.translate(cluster.map_T_box.position - cluster.centroid_map);
    }
    node.valid = {object.first_observed_ns, until_ns};
    node.first_observed_ns = object.first_observed_ns;
    node.last_observed_ns = object.last_observed_ns;
    node.observation_count = object.observation_count;
    node.object.emplace();
    node.object->color = cluster.color;
    node.object->size = cluster.size;
    node.object->mesh_instance_id = cluster.instance_id;
    if (fit != nullptr) SetShape(*fit, &node);
    if (place >= 0) {
      AddEdge(PlaceId(place), relations::kContains, node.id, 1.0).valid = node.valid;
      AddEdge(node.id, relations::kNearestPlace, PlaceId(place), 1.0).valid = node.valid;
    }
    delta_.nodes.push_back(std::move(node));
  }

  // The whole shape is known where the surface shows a side of it only.
  void SetShape(const ShapeFit& fit, Node* node) const {
    const CadModel& model = maker_.catalogue_[fit.model];
    Box3d box_model;
    for (const Eigen::Vector3d& vertex : model.vertices) box_model.extend(vertex);
    node->map_T_node = fit.map_T_model;
    node->map_T_node.position = fit.map_T_model * box_model.center();
    const Eigen::Vector3d half = 0.5 * box_model.sizes();
    node->box_node = Box3d(-half, half);
    node->object->size = box_model.sizes();
    node->object->model = model.asset.sha256;
    node->object->map_T_model = fit.map_T_model;
    node->object->registration_residual_m = fit.residual_m;
    node->confidence = fit.inlier_share;
    node->attributes["shape"] = model.name;
    node->attributes["shape_inlier_share"] = fit.inlier_share;
  }

  void AddRelations() {
    for (const ObjectRelation& relation : parts_.relations) {
      AddEdge(Id(kObjectLetter, relation.first), relation.relation.c_str(),
              Id(kObjectLetter, relation.second), relation.weight);
    }
    for (const CoVisibility::Pair& pair : parts_.together) {
      AddEdge(Id(kObjectLetter, pair.first), relations::kCoVisible, Id(kObjectLetter, pair.second),
              static_cast<double>(pair.picture_count));
    }
    for (const auto& [object, structure] : parts_.attached) {
      AddEdge(Id(kObjectLetter, parts_.objects[object].id), relations::kAttachedTo,
              StructureId(structure), 1.0);
    }
  }

  void AddPlaces() {
    for (size_t i = 0; i < parts_.places.places.size(); ++i) {
      const Place& place = parts_.places.places[i];
      Node node = MakeNode(Id(kPlaceLetter, place.id), layers::kPlaces, kinds::kPlace);
      node.map_T_node.position = place.position_map;
      // A point, so that the box over the objects of a place holds the place too.
      node.box_node = Box3d(Eigen::Vector3d::Zero().eval());
      node.class_name = ClassOf(place.kind);
      node.place = PlaceInfo{place.clearance_m, place.free_box, place.basis_point_count};
      if (!parts_.other_room_of_place.empty()) {
        node.attributes["room_by_other_method"] =
            static_cast<double>(parts_.other_room_of_place[i]);
      }
      if (parts_.room_of_place[i] >= 0) {
        AddEdge(RoomId(parts_.room_of_place[i]), relations::kContains, node.id, 1.0);
      }
      delta_.nodes.push_back(std::move(node));
    }
    for (const PlaceLink& link : parts_.places.links) {
      AddEdge(PlaceId(link.from), relations::kTraversable, PlaceId(link.to), link.clearance_m);
    }
  }

  void AddStructures() {
    for (size_t i = 0; i < parts_.structures.size(); ++i) {
      const StructurePiece& piece = parts_.structures[i];
      Node node = MakeNode(Id(kStructureLetter, piece.id), layers::kStructures, kinds::kStructure);
      node.class_id = piece.class_id;
      node.class_name = piece.class_id > 0 ? maker_.ClassName(piece.class_id) : piece.type;
      node.map_T_node.position = piece.box_map.center();
      node.box_node = BoxAround(piece.box_map, node.map_T_node.position);
      node.structure = StructureInfo{piece.type, piece.normal_map, piece.offset_m, 0};
      node.attributes["area_m2"] = piece.area_m2;
      delta_.nodes.push_back(std::move(node));
    }
    for (const auto& [structure, room] : parts_.encloses) {
      AddEdge(StructureId(structure), relations::kEncloses, RoomId(room), 1.0);
    }
  }

  void AddRooms() {
    for (size_t i = 0; i < parts_.rooms.size(); ++i) {
      const RoomPart& part = parts_.rooms[i];
      Node node = MakeNode(Id(kRoomLetter, part.room.id), layers::kRooms, kinds::kRoom);
      const Box3d box = BoxOf(part.room);
      if (!box.isEmpty()) {
        node.map_T_node.position = box.center();
        node.map_T_node.position.z() = part.room.z_min_m;
        node.box_node = BoxAround(box, node.map_T_node.position);
      }
      node.region = RegionInfo{part.room.footprint_map, part.room.z_min_m, part.room.z_max_m,
                               part.class_probabilities};
      SetClass(part.class_probabilities, &node);
      node.attributes["area_m2"] = part.room.area_m2;
      node.attributes["method"] = MethodName(part.method);
      delta_.nodes.push_back(std::move(node));
    }
    for (const auto& [a, b] : parts_.adjacent) {
      AddEdge(RoomId(a), relations::kAdjacent, RoomId(b), 1.0);
    }
    for (const auto& [a, b] : JoinedOverStoreys()) {
      AddEdge(RoomId(a), relations::kAdjacent, RoomId(b), 1.0);
    }
  }

  // Rooms of two storeys whose places stairs, a ramp or a lift joins. Within a storey rooms are
  // neighbours by their walls.
  std::set<std::pair<int, int>> JoinedOverStoreys() const {
    std::set<std::pair<int, int>> joined;
    for (const PlaceLink& link : parts_.places.links) {
      const int a = parts_.room_of_place[static_cast<size_t>(link.from)];
      const int b = parts_.room_of_place[static_cast<size_t>(link.to)];
      if (a < 0 || b < 0) continue;
      if (parts_.rooms[static_cast<size_t>(a)].storey ==
          parts_.rooms[static_cast<size_t>(b)].storey) {
        continue;
      }
      joined.insert(std::minmax(a, b));
    }
    return joined;
  }

  static void SetClass(const std::map<std::string, double>& probabilities, Node* node) {
    double best = 0.0;
    for (const auto& [name, probability] : probabilities) {
      if (probability <= best) continue;
      best = probability;
      node->class_name = name;
      node->confidence = probability;
    }
  }

  void AddBuilding() {
    Box3d box;
    for (const Node& node : delta_.nodes) box.extend(node.BoxMap());
    Node node = MakeNode(Id(kBuildingLetter, 0), layers::kBuildings, kinds::kBuilding);
    node.name = "building";
    node.map_T_node.position = box.center();
    node.map_T_node.position.z() = box.min().z();
    node.box_node = BoxAround(box, node.map_T_node.position);
    node.region = RegionInfo{Corners(box), box.min().z(), box.max().z(), {}};
    node.attributes[kSessionAttribute] = maker_.numbering_.session_id;
    std::vector<std::map<std::string, double>> rooms;
    for (const RoomPart& part : parts_.rooms) rooms.push_back(part.class_probabilities);
    SetClass(ClassifyBuilding(rooms), &node);
    const NodeId building = node.id;
    delta_.nodes.push_back(std::move(node));
    const bool has_levels = parts_.storeys.size() > 1;
    for (size_t i = 0; has_levels && i < parts_.storeys.size(); ++i) {
      AddLevel(static_cast<int64_t>(i), parts_.storeys[i], box);
      AddEdge(building, relations::kContains, Id(kLevelLetter, static_cast<int64_t>(i)), 1.0);
    }
    for (size_t i = 0; i < parts_.rooms.size(); ++i) {
      const NodeId parent = has_levels ? Id(kLevelLetter, parts_.rooms[i].storey) : building;
      AddEdge(parent, relations::kContains, RoomId(static_cast<int>(i)), 1.0);
    }
  }

  void AddLevel(int64_t index, const Storey& storey, const Box3d& building) {
    Node node = MakeNode(Id(kLevelLetter, index), kLevelLayer, kLevelKind);
    node.name = absl::StrCat("level ", index);
    Box3d box = building;
    box.min().z() = storey.floor_z_m;
    box.max().z() = storey.ceiling_z_m;
    node.map_T_node.position = box.center();
    node.map_T_node.position.z() = storey.floor_z_m;
    node.box_node = BoxAround(box, node.map_T_node.position);
    node.region = RegionInfo{Corners(box), storey.floor_z_m, storey.ceiling_z_m, {}};
    delta_.nodes.push_back(std::move(node));
  }

  const LayerGraphMaker& maker_;
  const LayerParts& parts_;
  /// Nodes and edges only.
  GraphDelta delta_;
};

LayerGraph LayerGraphMaker::Make(const LayerParts& parts) const {
  return Build(*this, parts).Take();
}

}  // namespace dsg::ingest
