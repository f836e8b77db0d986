// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_cluster.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "ingest/objects/euclidean_clusters.h"
#include "ingest/objects/floor_levels.h"
#include "ingest/objects/instance_parts.h"
#include "ingest/objects/surface_cells.h"
#include "ingest/objects/upright_box.h"

namespace dsg::ingest {
namespace {

class ClusterFinder {
 public:
  ClusterFinder(const std::vector<const MeshBlock*>& mesh, const ClusterOptions& options)
      : options_(options), class_ids_(options.class_ids) {
    std::sort(class_ids_.begin(), class_ids_.end());
    if (options_.tolerance_m <= 0.0) options_.tolerance_m = 2.0 * options_.voxel_m;
    surface_ = GatherSurface(mesh, class_ids_, options_.voxel_m);
    levels_ = options_.floor_z_m.has_value()
                  ? std::vector<double>{*options_.floor_z_m}
                  : FindFloorLevels(mesh, class_ids_, options_.pieces.floors);
  }

  /// Groups are given: `surface` is not looked at for more.
  ClusterFinder(ObjectSurface surface, std::vector<double> levels, double voxel_m,
                const PieceOptions& pieces)
      : surface_(std::move(surface)), levels_(std::move(levels)) {
    options_.voxel_m = voxel_m;
    options_.pieces = pieces;
  }

  std::vector<ObjectCluster> Find() const {
    std::vector<CellGroup> groups;
    for (size_t begin = 0; begin < surface_.cells.size();) {
      const size_t end = EndOfClass(begin);
      AddGroupsOfClass(begin, end, &groups);
      begin = end;
    }
    groups = MergeByInstance(surface_.cells, std::move(groups), options_.pieces);
    groups = DropEchoes(surface_.cells, std::move(groups), options_.pieces);
    std::erase_if(groups, [this](const CellGroup& group) { return !IsLargeEnough(group); });
    std::vector<ObjectCluster> clusters = Describe(groups);
    SortClusters(&clusters);
    return clusters;
  }

  std::vector<ObjectCluster> Describe(const std::vector<CellGroup>& groups) const {
    std::vector<ObjectCluster> clusters;
    for (const CellGroup& group : groups) clusters.push_back(MakeCluster(group));
    return clusters;
  }

 private:
  const SurfaceCell& CellAt(int index) const { return surface_.cells[static_cast<size_t>(index)]; }

  size_t EndOfClass(size_t begin) const {
    size_t end = begin;
    while (end < surface_.cells.size() &&
           surface_.cells[end].class_id == surface_.cells[begin].class_id) {
      ++end;
    }
    return end;
  }

  void AddGroupsOfClass(size_t begin, size_t end, std::vector<CellGroup>* groups) const {
    std::vector<Eigen::Vector3f> points;
    points.reserve(end - begin);
    for (size_t i = begin; i < end; ++i) points.push_back(surface_.cells[i].point_map);
    for (CellGroup& group : EuclideanClusters(points, options_.tolerance_m)) {
      for (int& index : group) index += static_cast<int>(begin);
      for (CellGroup& part :
           SplitByInstance(surface_.cells, group, options_.tolerance_m, options_.pieces)) {
        groups->push_back(std::move(part));
      }
    }
  }

  // Small things have few voxels; that they all have one instance makes up for half of them.
  bool IsLargeEnough(const CellGroup& group) const {
    const int count = static_cast<int>(group.size());
    if (count >= options_.pieces.cell_count_min) return true;
    const uint32_t instance = DominantInstance(surface_.cells, group, options_.pieces);
    if (instance == 0 || 2 * count < options_.pieces.cell_count_min) return false;
    return std::all_of(group.begin(), group.end(),
                       [&](int index) { return CellAt(index).instance_id == instance; });
  }

  ObjectCluster MakeCluster(const CellGroup& group) const {
    ObjectCluster cluster;
    cluster.class_id = CellAt(group.front()).class_id;
    cluster.instance_id = DominantInstance(surface_.cells, group, options_.pieces);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int index : group) {
      cluster.points_map.push_back(CellAt(index).point_map);
      sum += CellAt(index).point_map.cast<double>();
    }
    std::sort(cluster.points_map.begin(), cluster.points_map.end(),
              [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
                return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
              });
    cluster.centroid_map = sum / static_cast<double>(group.size());
    cluster.color = ColorOf(group);
    const UprightBox box = BoxOf(cluster.points_map, group);
    cluster.map_T_box = box.map_T_box;
    cluster.size = box.size;
    cluster.center_map = box.map_T_box.position;
    return cluster;
  }

  // Vertices are as dense as the mesh happens to be; their weights make each voxel count once.
  std::vector<WeightedPoint> VerticesOf(const CellGroup& group) const {
    std::vector<WeightedPoint> vertices;
    for (const int index : group) {
      const SurfaceCell& cell = CellAt(index);
      const float weight = 1.0f / static_cast<float>(cell.vertex_end - cell.vertex_begin);
      for (uint32_t i = cell.vertex_begin; i < cell.vertex_end; ++i) {
        vertices.push_back({surface_.vertices[i].position_map, weight});
      }
    }
    return vertices;
  }

  UprightBox BoxOf(std::vector<Eigen::Vector3f> points, const CellGroup& group) const {
    std::vector<WeightedPoint> vertices = VerticesOf(group);
    const BoxOptions& box_options = options_.pieces.box;
    const UprightBox all = FitUprightBox(vertices, 0.0, box_options);
    const double low_m = all.map_T_box.position.z() - 0.5 * all.size.z();
    const std::optional<double> floor_m = FloorBelow(levels_, low_m, options_.pieces.floors);
    if (!floor_m.has_value()) {
      return FitUprightBox(vertices, LeastFootprintYaw(points, box_options), box_options);
    }
    DropFloorSkin(*floor_m, &points, &vertices);
    UprightBox box = FitUprightBox(vertices, LeastFootprintYaw(points, box_options), box_options);
    if (StandsOnFloor(box, *floor_m, CellAt(group.front()).class_id)) {
      ExtendDownTo(*floor_m, &box);
    }
    return box;
  }

  // Labels that bled onto the floor would widen the box. What is mostly floor stays as it is.
  void DropFloorSkin(double floor_m, std::vector<Eigen::Vector3f>* points,
                     std::vector<WeightedPoint>* vertices) const {
    const double skin_m = floor_m + options_.pieces.floor_skin_voxels * options_.voxel_m;
    const auto is_skin = [skin_m](const Eigen::Vector3f& point) {
      return static_cast<double>(point.z()) <= skin_m;
    };
    const auto skin_count = std::count_if(points->begin(), points->end(), is_skin);
    const auto vertex_count =
        std::count_if(vertices->begin(), vertices->end(),
                      [&](const WeightedPoint& vertex) { return is_skin(vertex.point_map); });
    if (2 * skin_count >= std::ssize(*points) || 2 * vertex_count >= std::ssize(*vertices)) return;
    std::erase_if(*points, is_skin);
    std::erase_if(*vertices,
                  [&](const WeightedPoint& vertex) { return is_skin(vertex.point_map); });
  }

  bool StandsOnFloor(const UprightBox& box, double floor_m, int32_t class_id) const {
    const double low_m = box.map_T_box.position.z() - 0.5 * box.size.z();
    if (low_m <= floor_m) return false;
    const PieceOptions& pieces = options_.pieces;
    if (low_m - floor_m <= pieces.floor_reach_m) return true;
    const double side_m = std::min(box.size.x(), box.size.y());
    const bool is_slab = side_m >= pieces.table_side_m &&
                         box.size.z() <= pieces.table_flatness * side_m &&
                         low_m - floor_m <= pieces.table_height_m;
    return is_slab && !RestsOnObject(box, class_id);
  }

  // Something of another class reaches up to the lower side along half of the box's length.
  bool RestsOnObject(const UprightBox& box, int32_t class_id) const {
    const Pose3d box_T_map = box.map_T_box.Inverse();
    const double below_m = 0.5 * box.size.z();
    std::set<int64_t> columns;
    const int axis = box.size.x() >= box.size.y() ? 0 : 1;
    for (const SurfaceCell& cell : surface_.cells) {
      if (cell.class_id == class_id) continue;
      const Eigen::Vector3d point = box_T_map * cell.point_map.cast<double>();
      if (std::abs(point.x()) > 0.5 * box.size.x() || std::abs(point.y()) > 0.5 * box.size.y()) {
        continue;
      }
      if (point.z() > -below_m || point.z() < -below_m - 3.0 * options_.voxel_m) continue;
      columns.insert(static_cast<int64_t>(std::floor(point[axis] / options_.voxel_m)));
    }
    return 2.0 * static_cast<double>(columns.size()) * options_.voxel_m >= box.size[axis];
  }

  // Median of each channel: a few vertices of what is behind do not count.
  Color ColorOf(const CellGroup& group) const {
    if (!surface_.has_colors) return Color{};
    std::vector<uint8_t> channels[3];
    for (const int index : group) {
      for (uint32_t i = CellAt(index).vertex_begin; i < CellAt(index).vertex_end; ++i) {
        const uint32_t color = surface_.vertices[i].color;
        for (int channel = 0; channel < 3; ++channel) {
          channels[channel].push_back(static_cast<uint8_t>(color >> (16 - 8 * channel)));
        }
      }
    }
    Color result{0, 0, 0, 255};
    for (size_t channel = 0; channel < 3; ++channel) {
      auto& values = channels[channel];
      const auto middle = values.begin() + static_cast<int64_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      result[channel] = *middle;
    }
    return result;
  }

  ClusterOptions options_;
  std::vector<int32_t> class_ids_;
  ObjectSurface surface_;
  std::vector<double> levels_;
};

}  // namespace

std::vector<ObjectCluster> FindClusters(const std::vector<const MeshBlock*>& mesh,
                                        const ClusterOptions& options) {
  if (!(options.voxel_m > 0.0) || !std::isfinite(options.voxel_m)) return {};
  return ClusterFinder(mesh, options).Find();
}

void SortClusters(std::vector<ObjectCluster>* clusters) {
  const auto key = [](const ObjectCluster& cluster) {
    return std::tuple(cluster.class_id, cluster.center_map.x(), cluster.center_map.y(),
                      cluster.center_map.z(), cluster.instance_id);
  };
  std::stable_sort(clusters->begin(), clusters->end(),
                   [&](const ObjectCluster& a, const ObjectCluster& b) { return key(a) < key(b); });
}

std::vector<ObjectCluster> ClustersOfGroups(ObjectSurface surface,
                                            const std::vector<CellGroup>& groups,
                                            std::vector<double> floors_m, double voxel_m,
                                            const PieceOptions& options) {
  return ClusterFinder(std::move(surface), std::move(floors_m), voxel_m, options).Describe(groups);
}

}  // namespace dsg::ingest
