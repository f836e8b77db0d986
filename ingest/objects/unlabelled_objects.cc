// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/unlabelled_objects.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/objects/cell_graph.h"
#include "ingest/objects/cell_normals.h"
#include "ingest/objects/room_shell.h"
#include "ingest/objects/surface_cells.h"
#include "ingest/objects/surface_patches.h"

namespace dsg::ingest {
namespace {

/// What a group of cells is to the room around it.
struct RoomAroundGroup {
  double bottom_m = 0.0;
  double top_m = 0.0;
  double depth_m = INFINITY;
  /// How far it sticks out from the wall that it is on, infinite if it is on none.
  double before_wall_m = INFINITY;
  /// Share of its cells that touch a wall or a ceiling.
  double shell_contact = 0.0;
};

double Quantile(std::vector<double> values, double share) {
  const auto index = static_cast<int64_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return values[static_cast<size_t>(index)];
}

RoomAroundGroup RoomAround(const CellGraph& graph, const RoomShell& shell, const CellGroup& group,
                           double trim_share) {
  RoomAroundGroup result;
  std::vector<double> heights;
  for (const int cell : group) {
    const auto i = static_cast<size_t>(cell);
    heights.push_back(static_cast<double>(shell.heights_m[i]));
    result.depth_m = std::min(result.depth_m, static_cast<double>(shell.depths_m[i]));
  }
  const auto touches_shell = [&](int cell) {
    const std::span<const int> around = graph.NeighboursOf(cell);
    return std::any_of(around.begin(), around.end(), [&](int other) {
      const ShellPart part = shell.parts[static_cast<size_t>(other)];
      return part == ShellPart::kWall || part == ShellPart::kCeiling;
    });
  };
  result.shell_contact =
      static_cast<double>(std::count_if(group.begin(), group.end(), touches_shell)) /
      static_cast<double>(group.size());
  result.bottom_m = Quantile(heights, trim_share);
  result.top_m = Quantile(std::move(heights), 1.0 - trim_share);
  for (const ShellWall& wall : shell.walls) {
    std::vector<double> distances;
    size_t beside = 0;
    for (const int cell : group) {
      const Eigen::Vector3d point = graph.points_map[static_cast<size_t>(cell)].cast<double>();
      distances.push_back(std::abs(wall.DistanceTo(point)));
      beside += wall.IsBeside(point, graph.cell_m) ? 1 : 0;
    }
    if (2 * beside < group.size()) continue;
    result.before_wall_m =
        std::min(result.before_wall_m, Quantile(std::move(distances), 1.0 - trim_share));
  }
  return result;
}

bool MayBeObject(const RoomAroundGroup& around, const ObjectCluster& cluster,
                 const SegmentOptions& options) {
  std::array<double, 3> sides = {cluster.size.x(), cluster.size.y(), cluster.size.z()};
  std::sort(sides.begin(), sides.end());
  if (sides[2] > options.size_max_m || sides[2] < options.size_min_m) return false;
  if (sides[1] < options.sliver_m) return false;
  if (sides[0] < options.sliver_m && sides[1] < options.strip_share * sides[2]) return false;
  if (around.top_m < options.height_min_m || around.before_wall_m < options.mount_m) return false;
  if (around.shell_contact >= options.shell_contact) return false;
  if (around.bottom_m > options.reach_m) return false;
  const bool is_sheet = std::min(cluster.size.x(), cluster.size.y()) < options.sheet_m &&
                        around.top_m >= options.sheet_height_m;
  if (is_sheet && around.bottom_m < options.shell.full_height_m) return false;
  if (around.depth_m < options.shell.full_height_m && around.bottom_m < options.shell.full_height_m)
    return false;
  const double height_m = around.top_m - around.bottom_m;
  return around.depth_m + height_m > 2.0 * options.height_min_m;
}

// A large oblique face high above the floor is a roof's: furniture has none.
bool IsSlopedCeiling(const CellGraph& graph, const RoomShell& shell, const CellGroup& patch,
                     const SegmentOptions& options) {
  const double area_m2 = static_cast<double>(patch.size()) * graph.cell_m * graph.cell_m;
  if (area_m2 < options.ceiling_area_m2) return false;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double height_m = 0.0;
  for (const int cell : patch) {
    normal += graph.NormalAs(normal, cell);
    height_m += static_cast<double>(shell.heights_m[static_cast<size_t>(cell)]);
  }
  const double steepness = std::abs(normal.normalized().z());
  return steepness > options.shell.upright_normal && steepness < options.shell.level_normal &&
         height_m / static_cast<double>(patch.size()) >= options.slope_height_m;
}

// Floors, ceilings and walls say which side of the surface is the room's.
std::vector<Eigen::Vector3f> SidesOfShell(const CellGraph& graph, const RoomShell& shell,
                                          double level_normal) {
  std::vector<Eigen::Vector3f> sides(graph.size(), Eigen::Vector3f::Zero());
  for (size_t i = 0; i < graph.size(); ++i) {
    const Eigen::Vector3f& normal = graph.normals_map[i];
    if (shell.parts[i] == ShellPart::kFloor) sides[i] = Eigen::Vector3f::UnitZ();
    if (shell.parts[i] == ShellPart::kCeiling) sides[i] = -Eigen::Vector3f::UnitZ();
    if (std::abs(normal.dot(sides[i])) < level_normal) sides[i].setZero();
  }
  return sides;
}

}  // namespace

std::vector<ObjectCluster> FindUnlabelledObjects(const std::vector<const MeshBlock*>& mesh,
                                                 int32_t class_id, double voxel_m,
                                                 const std::vector<double>& floors_m,
                                                 const SegmentOptions& options,
                                                 const PieceOptions& pieces) {
  if (!(voxel_m > 0.0) || !std::isfinite(voxel_m)) return {};
  const double cell_m = std::max(voxel_m, options.cell_m);
  const ObjectSurface surface = GatherAllSurface(mesh, class_id, cell_m);
  CellGraph graph = MakeCellGraph(surface, cell_m, options.shell.same_face_cosine);
  const RoomShell shell = FindRoomShell(graph, floors_m, options);
  if (!graph.is_oriented)
    OrientNormals(SidesOfShell(graph, shell, options.shell.level_normal), &graph);
  std::vector<bool> is_free(graph.size());
  for (size_t i = 0; i < graph.size(); ++i) is_free[i] = shell.parts[i] == ShellPart::kNone;
  std::vector<CellGroup> patches = FindPatches(graph, is_free, options);
  std::erase_if(patches, [&](const CellGroup& patch) {
    return IsSlopedCeiling(graph, shell, patch, options);
  });
  std::vector<CellGroup> groups = JoinPatches(graph, shell.heights_m, patches, options);
  std::erase_if(groups, [&](const CellGroup& group) {
    return static_cast<double>(group.size()) * cell_m * cell_m < options.area_min_m2;
  });
  const std::vector<ObjectCluster> candidates =
      ClustersOfGroups(surface, groups, shell.floors_m, cell_m, pieces);
  std::vector<ObjectCluster> clusters;
  for (size_t i = 0; i < groups.size(); ++i) {
    if (!MayBeObject(RoomAround(graph, shell, groups[i], options.shell.trim_share), candidates[i],
                     options))
      continue;
    clusters.push_back(candidates[i]);
  }
  SortClusters(&clusters);
  return clusters;
}

}  // namespace dsg::ingest
