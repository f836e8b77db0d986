// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/structure_rooms.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

/// How densely walls and floors are looked at; denser says the same.
constexpr double kStepM = 0.2;

Eigen::AlignedBox2d Floor(const Box3d& box) {
  return {Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>())};
}

Eigen::AlignedBox2d BoundsOf(const Polygon2d& polygon) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : polygon) box.extend(corner);
  return box;
}

// The two ends of a wall on the floor: of its box's diagonals, the one that lies in its plane.
std::pair<Eigen::Vector2d, Eigen::Vector2d> EndsOf(const StructurePiece& wall) {
  const Eigen::AlignedBox2d box = Floor(wall.box_map);
  const Eigen::Vector2d normal = wall.normal_map.head<2>();
  const bool rises = normal.x() * normal.y() < 0.0;
  if (rises) return {box.min(), box.max()};
  return {Eigen::Vector2d(box.min().x(), box.max().y()),
          Eigen::Vector2d(box.max().x(), box.min().y())};
}

bool OverlapInHeight(const StructurePiece& piece, const FoundRoom& room) {
  return piece.box_map.min().z() < room.z_max_m && piece.box_map.max().z() > room.z_min_m;
}

bool WallBounds(const StructurePiece& wall, const FoundRoom& room,
                const StructureOptions& options) {
  const double near_m = options.near_m;
  if (!OverlapInHeight(wall, room)) return false;
  const auto [from, to] = EndsOf(wall);
  const double length_m = (to - from).norm();
  const Eigen::Vector2d into = wall.normal_map.head<2>().normalized();
  const int steps = std::max(1, static_cast<int>(std::lround(length_m / kStepM)));
  int hits = 0;
  for (int step = 0; step < steps; ++step) {
    const Eigen::Vector2d at = from + (to - from) * ((step + 0.5) / steps);
    if (std::abs(SignedDistanceToPolygon(room.footprint_map, at)) > near_m) continue;
    const bool faces = SignedDistanceToPolygon(room.footprint_map, at + near_m * into) < 0.0;
    const bool turns_away = SignedDistanceToPolygon(room.footprint_map, at - near_m * into) < 0.0;
    hits += faces && !turns_away ? 1 : 0;
  }
  return hits * length_m / steps >= std::min(options.along_m, options.along_share * length_m);
}

// Whether they share an area, by points.
bool LiesOver(const StructurePiece& piece, const FoundRoom& room, double m2_min) {
  const Eigen::AlignedBox2d shared =
      Floor(piece.box_map).intersection(BoundsOf(room.footprint_map));
  if (shared.isEmpty()) return false;
  int hits = 0;
  for (double y = shared.min().y() + 0.5 * kStepM; y < shared.max().y(); y += kStepM) {
    for (double x = shared.min().x() + 0.5 * kStepM; x < shared.max().x(); x += kStepM) {
      if (PolygonContains(room.footprint_map, {x, y}) && ++hits * kStepM * kStepM >= m2_min) {
        return true;
      }
    }
  }
  return false;
}

bool Bounds(const StructurePiece& piece, const FoundRoom& room, const StructureOptions& options) {
  if (room.footprint_map.size() < 3 || piece.box_map.isEmpty()) return false;
  Eigen::AlignedBox2d near = BoundsOf(room.footprint_map);
  near.min().array() -= options.near_m;
  near.max().array() += options.near_m;
  if (!near.intersects(Floor(piece.box_map))) return false;
  const double z_m = piece.box_map.center().z();
  if (piece.type == "floor" || piece.type == "ceiling") {
    const double room_z_m = piece.type == "floor" ? room.z_min_m : room.z_max_m;
    return std::abs(z_m - room_z_m) < options.near_m && LiesOver(piece, room, options.over_m2);
  }
  if (piece.type == "pillar") {
    const Eigen::Vector2d middle = piece.box_map.center().head<2>();
    return OverlapInHeight(piece, room) &&
           SignedDistanceToPolygon(room.footprint_map, middle) < options.near_m;
  }
  return WallBounds(piece, room, options);
}

// How far a thing is from the side of a piece on which things hang, metres; nullopt = it is not on
// that side.
std::optional<double> HangGap(const StructurePiece& piece, const Pose3d& map_T_thing,
                              const Eigen::Vector3d& size) {
  const Box3d thing_map = TransformBox(map_T_thing, Box3d(-0.5 * size, 0.5 * size));
  if (piece.type == "pillar") return piece.box_map.exteriorDistance(thing_map);
  if (piece.type == "ceiling") {
    return std::abs(piece.box_map.center().z() - thing_map.max().z());
  }
  if (piece.type != "wall") return std::nullopt;
  // Of the box as it is turned: in a map that lies askew one along the axes is far too thick.
  const Eigen::Vector3d normal_thing = map_T_thing.orientation.conjugate() * piece.normal_map;
  const double reach_m = normal_thing.cwiseAbs().dot(0.5 * size);
  const double middle_m = piece.normal_map.dot(map_T_thing.position) + piece.offset_m;
  if (middle_m < 0.0) return std::nullopt;
  // Before the wall, or sunk into it as far as a noisy box may be.
  return std::abs(middle_m - reach_m);
}

}  // namespace

std::vector<std::pair<int, int>> EnclosesOf(const std::vector<StructurePiece>& pieces,
                                            const std::vector<FoundRoom>& rooms,
                                            const StructureOptions& options) {
  std::vector<std::pair<int, int>> pairs;
  for (size_t piece = 0; piece < pieces.size(); ++piece) {
    for (size_t room = 0; room < rooms.size(); ++room) {
      if (Bounds(pieces[piece], rooms[room], options)) {
        pairs.emplace_back(static_cast<int>(piece), static_cast<int>(room));
      }
    }
  }
  return pairs;
}

std::optional<int> AttachedTo(const Pose3d& map_T_box, const Eigen::Vector3d& size,
                              const std::vector<StructurePiece>& pieces,
                              const StructureOptions& options) {
  const Box3d box_map = TransformBox(map_T_box, Box3d(-0.5 * size, 0.5 * size));
  std::optional<int> best;
  double best_m = options.hang_gap_m;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const StructurePiece& piece = pieces[i];
    if (piece.box_map.isEmpty()) continue;
    if (piece.box_map.exteriorDistance(box_map) >= options.hang_gap_m) continue;
    const std::optional<double> gap_m = HangGap(piece, map_T_box, size);
    if (!gap_m.has_value() || *gap_m >= best_m) continue;
    best_m = *gap_m;
    best = static_cast<int>(i);
  }
  return best;
}

}  // namespace dsg::ingest
