// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/map_things.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include "absl/strings/ascii.h"

namespace dsg::ingest {
namespace {

// `behind_m`: how far behind its surface the middle may be, besides half its size.
bool IsInView(const TrackedObject& object, const DepthFrame& frame, double behind_m) {
  const Eigen::Vector3d center_camera = frame.map_T_camera.Inverse() * object.cluster.center_map;
  if (center_camera.z() <= 0.1) return false;
  const Eigen::Vector2d pixel = Project(frame.camera, center_camera);
  const double column = std::round(pixel.x());
  const double row = std::round(pixel.y());
  if (!(column >= 0.0 && row >= 0.0 && column < frame.camera.width && row < frame.camera.height)) {
    return false;
  }
  const size_t index = static_cast<size_t>(row) * static_cast<size_t>(frame.camera.width) +
                       static_cast<size_t>(column);
  const float depth_m = frame.depth_m[index];
  const double reach_m = 0.5 * object.cluster.size.norm() + behind_m;
  return depth_m > 0.0f && std::abs(static_cast<double>(depth_m) - center_camera.z()) <= reach_m;
}

}  // namespace

std::vector<SemanticLabel> NamesOf(const std::vector<SemanticLabel>& labels) {
  return labels.empty() ? std::vector<SemanticLabel>{{kThingClass, kThingName}} : labels;
}

std::vector<int32_t> DynamicClasses(const std::vector<SemanticLabel>& labels) {
  std::vector<int32_t> classes;
  for (const SemanticLabel& label : labels) {
    const std::string name = absl::AsciiStrToLower(label.name);
    if (name == "human" || name == "person" || name == "people") classes.push_back(label.id);
  }
  return classes;
}

std::vector<int32_t> ObjectClasses(const std::vector<SemanticLabel>& labels,
                                   const StructureClasses& structures,
                                   const std::vector<int32_t>& dynamic_classes) {
  if (labels.empty()) return {kThingClass};
  std::vector<int32_t> classes;
  for (const SemanticLabel& label : labels) {
    const bool is_dynamic = std::find(dynamic_classes.begin(), dynamic_classes.end(), label.id) !=
                            dynamic_classes.end();
    if (label.id != 0 && !is_dynamic && !structures.IsStructure(label.id)) {
      classes.push_back(label.id);
    }
  }
  return classes;
}

bool HasModelOf(const std::vector<CadModel>& catalogue, std::string_view class_name) {
  const std::string wanted = absl::AsciiStrToLower(std::string(class_name));
  return std::any_of(catalogue.begin(), catalogue.end(), [&wanted](const CadModel& model) {
    return absl::AsciiStrToLower(model.class_name) == wanted;
  });
}

std::vector<double> FloorsOf(const std::vector<StructurePiece>& structures,
                             const std::vector<Eigen::Vector3d>& path_map,
                             const StructureOptions& options, const StoreyOptions& storeys) {
  std::vector<double> floors;
  for (const StructureHeight& height : FloorHeights(structures, options)) {
    if (height.area_m2 < storeys.floor_m2_min) continue;
    const auto is_above = [&height, &storeys](const Eigen::Vector3d& point_map) {
      return point_map.z() > height.z_m && point_map.z() < height.z_m + storeys.robot_above_m;
    };
    if (std::none_of(path_map.begin(), path_map.end(), is_above)) continue;
    const bool is_apart = std::all_of(floors.begin(), floors.end(), [&](double floor_m) {
      return std::abs(floor_m - height.z_m) >= storeys.floor_apart_m;
    });
    if (is_apart) floors.push_back(height.z_m);
  }
  std::sort(floors.begin(), floors.end());
  return floors;
}

std::optional<double> CeilingAbove(const std::vector<StructurePiece>& structures, double floor_z_m,
                                   const StructureOptions& options, const StoreyOptions& storeys) {
  for (const StructureHeight& height : CeilingHeights(structures, options)) {
    if (height.z_m > floor_z_m + storeys.ceiling_m_min &&
        height.z_m < floor_z_m + storeys.ceiling_m_max) {
      return height.z_m;
    }
  }
  return std::nullopt;
}

std::optional<double> FloorUnder(const ObjectCluster& object, const std::vector<double>& floors_m,
                                 const StoreyOptions& storeys) {
  const double low_m = object.map_T_box.position.z() - 0.5 * object.size.z();
  for (const double floor_m : floors_m) {
    if (std::abs(low_m - floor_m) < storeys.standing_m) return floor_m;
  }
  return std::nullopt;
}

std::vector<int32_t> GlassClasses(const std::vector<SemanticLabel>& labels) {
  std::vector<int32_t> classes;
  for (const SemanticLabel& label : labels) {
    const std::string name = absl::AsciiStrToLower(label.name);
    if (name == "glass" || name == "window") classes.push_back(label.id);
  }
  return classes;
}

void CloseGlass(const std::vector<const MeshBlock*>& mesh, const std::vector<int32_t>& classes,
                const std::vector<double>& floors_m, double body_height_m,
                const StoreyOptions& storeys, OccupancyGrid* grid) {
  if (classes.empty() || floors_m.empty()) return;
  const GridFrame& frame = grid->frame;
  for (const MeshBlock* block : mesh) {
    for (size_t i = 0; i < block->labels.size(); ++i) {
      const auto label = static_cast<int32_t>(block->labels[i]);
      if (std::find(classes.begin(), classes.end(), label) == classes.end()) continue;
      const Eigen::Vector3d vertex_map = block->positions_map[i].cast<double>();
      const auto above =
          std::upper_bound(floors_m.begin(), floors_m.end(), vertex_map.z() + storeys.standing_m);
      const double floor_m = above == floors_m.begin() ? floors_m.front() : *std::prev(above);
      Eigen::Vector3d top_map = vertex_map;
      top_map.z() = std::max(vertex_map.z(), floor_m + body_height_m);
      Eigen::Vector3i cell = frame.CellOf({vertex_map.x(), vertex_map.y(), floor_m});
      for (const int top = frame.CellOf(top_map).z(); cell.z() <= top; ++cell.z()) {
        if (frame.Holds(cell)) grid->cells[frame.Index(cell)] = Occupancy::kOccupied;
      }
    }
  }
}

std::vector<int64_t> ObjectsInView(const std::vector<TrackedObject>& objects,
                                   const DepthFrame& frame, const StoreyOptions& storeys) {
  std::vector<int64_t> visible;
  for (const TrackedObject& object : objects) {
    if (IsInView(object, frame, storeys.in_view_m)) visible.push_back(object.id);
  }
  return visible;
}

std::vector<CoVisibility::Pair> KnownPairs(std::vector<CoVisibility::Pair> pairs,
                                           const std::vector<TrackedObject>& objects) {
  std::vector<int64_t> ids;
  for (const TrackedObject& object : objects) ids.push_back(object.id);
  const auto is_known = [&ids](int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  std::erase_if(pairs, [&](const CoVisibility::Pair& pair) {
    return !is_known(pair.first) || !is_known(pair.second);
  });
  return pairs;
}

RoomsOfStorey FindRoomsOfStorey(const DistanceField& field, const PlaceGraph& places,
                                const Storey& storey, const RoomOptions& options) {
  RoomInput input;
  input.field = &field;
  input.floor_z_m = storey.floor_z_m;
  if (storey.has_ceiling) input.ceiling_z_m = storey.ceiling_z_m;
  std::unordered_map<int, int> local_of;
  for (const int place : storey.places) {
    local_of[place] = static_cast<int>(input.places.size());
    input.places.push_back({places.places[place].position_map, places.places[place].clearance_m});
  }
  for (const PlaceLink& link : places.links) {
    const auto from = local_of.find(link.from);
    const auto to = local_of.find(link.to);
    if (from == local_of.end() || to == local_of.end()) continue;
    input.links.push_back({from->second, to->second, link.clearance_m});
  }
  RoomResult found = FindRooms(input, options);
  RoomsOfStorey rooms;
  rooms.method = found.best.method;
  rooms.adjacent = std::move(found.best.adjacent);
  for (FoundRoom& room : found.best.rooms) {
    for (int& place : room.places) place = storey.places[place];
    rooms.rooms.push_back(std::move(room));
  }
  if (found.alternative.has_value()) {
    for (size_t i = 0; i < storey.places.size(); ++i) {
      rooms.other_room_of_place.push_back({storey.places[i], found.alternative->room_of_place[i]});
    }
  }
  return rooms;
}

double AspectOf(const Polygon2d& polygon) {
  double least_area = std::numeric_limits<double>::infinity();
  double aspect = 1.0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (side.norm() < 1e-6) continue;
    const Eigen::Vector2d u = side.normalized();
    const Eigen::Vector2d v(-u.y(), u.x());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : polygon)
      box.extend(Eigen::Vector2d(u.dot(corner), v.dot(corner)));
    const Eigen::Vector2d size = box.sizes();
    if (size.prod() >= least_area || size.minCoeff() < 1e-6) continue;
    least_area = size.prod();
    aspect = size.maxCoeff() / size.minCoeff();
  }
  return aspect;
}

}  // namespace dsg::ingest
