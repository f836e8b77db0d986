// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/building.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "ingest/simulator/scene/room_look.h"
#include "ingest/simulator/scene/shapes.h"
#include "ingest/simulator/scene/texture.h"

namespace dsg::simulator {
namespace {

/// Of the triangles of walls and floors, so that light changes smoothly over them.
constexpr float kBuildingEdgeM = 0.7f;
constexpr double kTinyM = 1e-4;
constexpr size_t kWallsPerBlank = 14;

constexpr double kSkirtHeightM = 0.08;
constexpr double kSkirtDepthM = 0.012;
constexpr double kFrameWidthM = 0.07;
constexpr double kFrameDepthM = 0.015;
/// How far a door's frame stands into the opening.
constexpr double kFrameStepM = 0.01;

constexpr double kLampPitchM = 2.4;
constexpr double kLampHeightM = 0.03;

class Builder {
 public:
  Builder(const FloorPlan& plan, Scene* scene) : plan_(plan), scene_(scene), seed_(SeedOf(plan)) {
    DrawBlankWalls();
    DrawDarkRoom();
  }

  void Build() {
    for (int i = 0; i < static_cast<int>(plan_.structures.size()); ++i) AddStructure(i);
    for (int i = 0; i < static_cast<int>(plan_.doors.size()); ++i) AddFrame(i);
    for (int i = 0; i < static_cast<int>(plan_.rooms.size()); ++i) AddLamps(i);
  }

 private:
  // Another plan, other textures; the world has no seed of its own to ask for.
  static uint32_t SeedOf(const FloorPlan& plan) {
    uint32_t seed = 1;
    for (const Room& room : plan.rooms) {
      for (const double edge :
           {room.cell.min().x(), room.cell.min().y(), room.cell.max().x(), room.cell.max().y()}) {
        seed = Hash(seed, static_cast<uint32_t>(std::lround(edge * 100.0)));
      }
    }
    return seed;
  }

  void DrawBlankWalls() {
    std::vector<std::pair<uint32_t, int>> walls;
    for (int i = 0; i < static_cast<int>(plan_.structures.size()); ++i) {
      const Structure& structure = plan_.structures[i];
      if (structure.type == "wall" && structure.z_min_m < kTinyM) {
        walls.emplace_back(Hash(seed_, static_cast<uint32_t>(i)), i);
      }
    }
    std::sort(walls.begin(), walls.end());
    for (size_t i = 0; i < (walls.size() + kWallsPerBlank / 2) / kWallsPerBlank; ++i)
      blank_.insert(walls[i].second);
  }

  void DrawDarkRoom() {
    std::vector<int> corridors;
    for (int i = 0; i < static_cast<int>(plan_.rooms.size()); ++i) {
      if (plan_.rooms[i].class_name == "corridor") corridors.push_back(i);
    }
    if (corridors.size() >= 2) dark_ = corridors[seed_ % corridors.size()];
  }

  // Good until the next call.
  Part* AddPart(const char* class_name, int room, Material material, const Color& color) {
    Part part;
    part.material = material;
    part.color = color;
    part.class_id = ClassId(class_name);
    part.room = room;
    part.texture_seed = Hash(seed_, static_cast<uint32_t>(scene_->parts.size())) << 2;
    scene_->parts.push_back(std::move(part));
    return &scene_->parts.back();
  }

  RoomLook Look(int room) const {
    return RoomLookOf(plan_.rooms[room].class_name,
                      Hash(seed_, 1000u + static_cast<uint32_t>(room)));
  }

  void AddStructure(int index) {
    const Structure& structure = plan_.structures[index];
    if (structure.type == "floor") {
      AddFloor(structure);
    } else if (structure.type == "ceiling") {
      AddCeiling(structure);
    } else if (structure.type == "wall") {
      AddWall(structure, blank_.count(index) > 0);
    } else if (structure.type == "glass") {
      AddGlass(structure);
    } else if (structure.type == "pillar") {
      AddPillar(structure);
    }
  }

  void AddFloor(const Structure& structure) {
    const RoomLook look = Look(structure.room);
    Part* part = AddPart("floor", structure.room, look.floor, look.floor_color);
    part->texture_seed |= 1u;
    AddLevel(structure.rect, structure.z_max_m, true, &part->mesh);
    Subdivide(kBuildingEdgeM, &part->mesh);
  }

  void AddCeiling(const Structure& structure) {
    Part* part =
        AddPart("ceiling", structure.room, Look(structure.room).ceiling, {226, 226, 222, 255});
    part->texture_seed |= 3u;
    AddLevel(structure.rect, structure.z_min_m, false, &part->mesh);
    Subdivide(kBuildingEdgeM, &part->mesh);
  }

  void AddWall(const Structure& structure, bool is_blank) {
    const RoomLook look = Look(structure.room);
    Part* part = AddPart("wall", structure.room, is_blank ? Material::kBlank : Material::kPlaster,
                         look.wall_color);
    AddFront(structure, structure.z_min_m, structure.z_max_m, &part->mesh);
    AddEnds(structure, &part->mesh);
    if (structure.z_min_m > kTinyM) AddLevel(structure.rect, structure.z_min_m, false, &part->mesh);
    Subdivide(kBuildingEdgeM, &part->mesh);
    if (structure.z_min_m < kTinyM) AddSkirting(structure);
  }

  // Ends of the face that the room sees. Corners belong to two walls; there the face stops.
  std::pair<Point, Point> FaceOf(const Structure& structure) const {
    const Rect inside = plan_.rooms[structure.room].Interior();
    const int across = structure.normal.x() != 0.0 ? 0 : 1;
    const int along = 1 - across;
    Point from = structure.rect.min();
    Point to = structure.rect.max();
    from[along] = std::max(from[along], inside.min()[along]);
    to[along] = std::min(to[along], inside.max()[along]);
    const bool faces_up = structure.normal[across] > 0.0;
    from[across] = to[across] =
        faces_up ? structure.rect.max()[across] : structure.rect.min()[across];
    return {from, to};
  }

  void AddFront(const Structure& structure, double low, double high, TriangleMesh* mesh) const {
    const auto [from, to] = FaceOf(structure);
    if ((to - from).sum() > kTinyM) {
      AddUpright(from, to, low, high, structure.normal.head<2>(), mesh);
    }
  }

  // The sides of openings and of glass, as far as no wall goes on there.
  void AddEnds(const Structure& structure, TriangleMesh* mesh) const {
    const int along = structure.normal.x() != 0.0 ? 1 : 0;
    const Rect& rect = structure.rect;
    const Rect& cell = plan_.rooms[structure.room].cell;
    for (const bool at_high : {false, true}) {
      const double edge = at_high ? rect.max()[along] : rect.min()[along];
      const double end = at_high ? cell.max()[along] : cell.min()[along];
      if (std::abs(edge - end) < kTinyM) continue;
      Point beyond = rect.center();
      beyond[along] = edge + (at_high ? 0.01 : -0.01);
      const double high = FreeUpTo(structure, beyond);
      if (high - structure.z_min_m < kTinyM) continue;
      Point from = rect.min();
      Point to = rect.max();
      from[along] = to[along] = edge;
      Point normal = Point::Zero();
      normal[along] = at_high ? 1.0 : -1.0;
      AddUpright(from, to, structure.z_min_m, high, normal, mesh);
    }
  }

  // Height at which a neighbouring piece of the same room's wall begins.
  double FreeUpTo(const Structure& structure, const Point& beyond) const {
    double high = structure.z_max_m;
    for (const Structure& other : plan_.structures) {
      if (other.type == "wall" && other.room == structure.room && other.rect.contains(beyond)) {
        high = std::min(high, other.z_min_m);
      }
    }
    return high;
  }

  void AddSkirting(const Structure& structure) {
    const auto [from, to] = FaceOf(structure);
    if ((to - from).sum() < 4.0 * kSkirtDepthM) return;
    const Point depth = kSkirtDepthM * structure.normal.head<2>();
    Part* part = AddPart("wall", structure.room, Material::kWood, {176, 168, 156, 255});
    AddUpright(from + depth, to + depth, 0.0, kSkirtHeightM, structure.normal.head<2>(),
               &part->mesh);
    Rect top(from.cwiseMin(from + depth), to.cwiseMax(to + depth));
    AddLevel(top, kSkirtHeightM, true, &part->mesh);
    const int along = structure.normal.x() != 0.0 ? 1 : 0;
    for (const Point& end : {from, to}) {
      Point normal = Point::Zero();
      normal[along] = end == from ? -1.0 : 1.0;
      AddUpright(end, end + depth, 0.0, kSkirtHeightM, normal, &part->mesh);
    }
    Subdivide(kBuildingEdgeM, &part->mesh);
  }

  // A pane on the room's face, held by bars.
  void AddGlass(const Structure& structure) {
    constexpr double kBarM = 0.05;
    Part* pane = AddPart("glass", structure.room, Material::kGlass, {150, 176, 180, 255});
    AddFront(structure, structure.z_min_m, structure.z_max_m, &pane->mesh);
    Subdivide(1.0f, &pane->mesh);
    Part* bars = AddPart("glass", structure.room, Material::kMetal, {92, 96, 100, 255});
    const int along = structure.normal.x() != 0.0 ? 1 : 0;
    const Rect& rect = structure.rect;
    const double length = rect.sizes()[along];
    const int count = std::max(1, static_cast<int>(std::lround(length / 1.2)));
    for (int i = 0; i <= count; ++i) {
      Rect bar = rect;
      bar.min()[along] += (length - kBarM) * i / count;
      bar.max()[along] = bar.min()[along] + kBarM;
      AddBlock(bar, structure.z_min_m, structure.z_max_m, &bars->mesh);
    }
    AddBlock(rect, structure.z_min_m, structure.z_min_m + 0.1, &bars->mesh);
    AddBlock(rect, structure.z_max_m - kBarM, structure.z_max_m, &bars->mesh);
    Subdivide(1.0f, &bars->mesh);
  }

  void AddPillar(const Structure& structure) {
    Part* part = AddPart("pillar", structure.room, Material::kPlaster, {188, 186, 180, 255});
    AddBlock(structure.rect, structure.z_min_m, structure.z_max_m, &part->mesh);
    Subdivide(kBuildingEdgeM, &part->mesh);
  }

  void AddFrame(int index) {
    const Door& door = plan_.doors[index];
    if (door.kind != OpeningKind::kDoor) return;
    const int along = door.walks_along_y ? 0 : 1;
    const int across = 1 - along;
    static constexpr Color kColors[] = {
        {150, 112, 74, 255}, {196, 190, 178, 255}, {108, 84, 62, 255}};
    Part* part = AddPart("wall", door.room_b, Material::kWood,
                         kColors[Hash(seed_, 500u + static_cast<uint32_t>(index)) % 3]);
    const double half = 0.5 * door.width_m;
    const double depth = kHalfWallM + kFrameDepthM;
    for (const double side : {-1.0, 1.0}) {
      Point near_corner;
      Point far_corner;
      near_corner[along] = door.center[along] + side * (half - kFrameStepM);
      far_corner[along] = door.center[along] + side * (half + kFrameWidthM);
      near_corner[across] = door.center[across] - depth;
      far_corner[across] = door.center[across] + depth;
      const Rect post(near_corner.cwiseMin(far_corner), near_corner.cwiseMax(far_corner));
      AddBlock(post, 0.0, kDoorHeightM - kFrameStepM, &part->mesh);
    }
    Point reach;
    reach[along] = half + kFrameWidthM;
    reach[across] = depth;
    AddBlock(Rect(door.center - reach, door.center + reach), kDoorHeightM - kFrameStepM,
             kDoorHeightM + kFrameWidthM, &part->mesh);
    Subdivide(1.0f, &part->mesh);
  }

  void AddLamps(int index) {
    const Room& room = plan_.rooms[index];
    const bool is_dark = index == dark_;
    RoomLight light;
    light.interior = room.Interior();
    light.ceiling_m = static_cast<float>(room.ceiling_m);
    light.ambient = is_dark ? 0.16f : 0.62f;
    const Point size = light.interior.sizes();
    const int columns = std::max(1, static_cast<int>(std::lround(size.x() / kLampPitchM)));
    const int rows = std::max(1, static_cast<int>(std::lround(size.y() / kLampPitchM)));
    const double area_m2 = size.prod() / (columns * rows);
    light.strength = (is_dark ? 0.12f : 0.48f) * static_cast<float>(area_m2 / std::numbers::pi);
    Part* part = AddPart("ceiling", index, Material::kPlastic, {244, 244, 238, 255});
    part->emission = is_dark ? 0.0f : 0.6f;
    for (int column = 0; column < columns; ++column) {
      for (int row = 0; row < rows; ++row) {
        const Point middle = light.interior.min() + Point(size.x() * (column + 0.5) / columns,
                                                          size.y() * (row + 0.5) / rows);
        const Point half = size.x() > size.y() ? Point(0.6, 0.15) : Point(0.15, 0.6);
        const double low = room.ceiling_m - kLampHeightM;
        AddBlock(Rect(middle - half, middle + half), low, room.ceiling_m, &part->mesh);
        light.lamps_map.push_back(Eigen::Vector3d(middle.x(), middle.y(), low).cast<float>());
      }
    }
    Subdivide(1.0f, &part->mesh);
    scene_->lights.push_back(std::move(light));
  }

  const FloorPlan& plan_;
  Scene* const scene_;
  const uint32_t seed_;
  /// Indices of structures.
  std::set<int> blank_;
  /// Index of a room; -1 = none.
  int dark_ = -1;
};

}  // namespace

void AddBuilding(const FloorPlan& plan, Scene* scene) { Builder(plan, scene).Build(); }

}  // namespace dsg::simulator
