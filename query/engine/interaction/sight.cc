// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kBodyM = 0.2;
constexpr size_t kBlocksKeptMax = 512;

bool IsWallLike(std::string_view name) {
  static constexpr std::array<std::string_view, 7> kNames = {
      "wall", "pillar", "column", "floor", "ceiling", "beam", "structure"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

struct Line {
  Eigen::Vector3d from_map;
  Eigen::Vector3d to_map;
};

// Nothing is left of short ones.
std::optional<Line> Trimmed(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map) {
  const Eigen::Vector3d way = to_map - from_map;
  const double length_m = way.norm();
  if (length_m <= 2.0 * kBodyM) return std::nullopt;
  const Eigen::Vector3d end = way * (kBodyM / length_m);
  return Line{from_map + end, to_map - end};
}

// Source: Moeller and Trumbore, 1997.
bool Crosses(const Line& line, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
             const Eigen::Vector3d& c) {
  const Eigen::Vector3d way = line.to_map - line.from_map;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d p = way.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0.0) return false;
  const Eigen::Vector3d t = line.from_map - a;
  const double u = t.dot(p) / determinant;
  const Eigen::Vector3d q = t.cross(ab);
  const double v = way.dot(q) / determinant;
  const double along = ac.dot(q) / determinant;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along >= 0.0 && along <= 1.0;
}

bool CrossesBox(const Line& line, const Box3d& box) {
  double from = 0.0, to = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double start = line.from_map[axis];
    const double way = line.to_map[axis] - start;
    if (way == 0.0) {
      if (start < box.min()[axis] || start > box.max()[axis]) return false;
      continue;
    }
    double low = (box.min()[axis] - start) / way;
    double high = (box.max()[axis] - start) / way;
    if (low > high) std::swap(low, high);
    from = std::max(from, low);
    to = std::min(to, high);
  }
  return from <= to;
}

class WallBoxes final : public Sight {
 public:
  explicit WallBoxes(std::vector<Node> walls) : walls_(std::move(walls)) {
    for (const Node& wall : walls_) node_T_map_.push_back(wall.map_T_node.Inverse());
  }

  absl::StatusOr<bool> IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                               TimeNs at_ns) override {
    const auto line = Trimmed(from_map, to_map);
    if (!line.has_value()) return true;
    for (size_t i = 0; i < walls_.size(); ++i) {
      if (!walls_[i].valid.Contains(at_ns)) continue;
      const Line in_node{node_T_map_[i] * line->from_map, node_T_map_[i] * line->to_map};
      if (CrossesBox(in_node, walls_[i].box_node)) return false;
    }
    return true;
  }

 private:
  std::vector<Node> walls_;
  std::vector<Pose3d> node_T_map_;
};

using Triangle = std::array<Eigen::Vector3f, 3>;

class MeshSight final : public Sight {
 public:
  MeshSight(const Snapshot& snapshot, std::vector<BlockIndex> blocks,
            std::optional<std::set<uint32_t>> wall_labels, StopCheck stop)
      : snapshot_(snapshot),
        blocks_(std::move(blocks)),
        wall_labels_(std::move(wall_labels)),
        stop_(std::move(stop)) {}

  absl::StatusOr<bool> IsClear(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                               TimeNs) override {
    const auto line = Trimmed(from_map, to_map);
    if (!line.has_value()) return true;
    Box3d box(line->from_map);
    box.extend(line->to_map);
    const double size_m = snapshot_.spec().mesh_block_size_m;
    // A face belongs to the block of its first vertex and may reach into the next one.
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(0.25);
    const BlockIndex low = BlockOf((box.min() - reach).cast<float>(), size_m);
    const BlockIndex high = BlockOf((box.max() + reach).cast<float>(), size_m);
    for (int32_t x = low.x; x <= high.x; ++x) {
      for (int32_t y = low.y; y <= high.y; ++y) {
        for (int32_t z = low.z; z <= high.z; ++z) {
          DSG_ASSIGN_OR_RETURN(const std::vector<Triangle>* walls, WallsOf({x, y, z}));
          for (const Triangle& t : *walls) {
            if (Crosses(*line, t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>())) {
              return false;
            }
          }
        }
      }
    }
    return true;
  }

 private:
  absl::StatusOr<const std::vector<Triangle>*> WallsOf(BlockIndex index) {
    const auto known = walls_.find(index);
    if (known != walls_.end()) return &known->second;
    if (walls_.size() >= kBlocksKeptMax) walls_.clear();
    std::vector<Triangle>& walls = walls_[index];
    if (!std::binary_search(blocks_.begin(), blocks_.end(), index)) return &walls;
    // A line through a hall reads hundreds of them.
    DSG_RETURN_IF_ERROR(AskStop(stop_));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, snapshot_.ReadMeshBlock(index));
    for (const auto& face : block.faces) {
      if (!IsWall(block, face)) continue;
      walls.push_back({block.positions_map[face[0]], block.positions_map[face[1]],
                       block.positions_map[face[2]]});
    }
    return &walls;
  }

  bool IsWall(const MeshBlock& block, const std::array<uint32_t, 3>& face) const {
    if (!wall_labels_.has_value() || block.labels.empty()) return true;
    return std::all_of(face.begin(), face.end(), [&](uint32_t vertex) {
      return wall_labels_->contains(block.labels[vertex]);
    });
  }

  const Snapshot& snapshot_;
  std::vector<BlockIndex> blocks_;
  /// nullopt: the map has no labels, all surfaces count.
  std::optional<std::set<uint32_t>> wall_labels_;
  const StopCheck stop_;
  std::map<BlockIndex, std::vector<Triangle>> walls_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Sight>> Sight::Make(const Snapshot& snapshot,
                                                   const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(std::vector<BlockIndex> blocks, snapshot.MeshBlocks());
  if (!blocks.empty()) {
    DSG_ASSIGN_OR_RETURN(const std::vector<SemanticLabel> labels, snapshot.Labels());
    std::optional<std::set<uint32_t>> walls;
    if (!labels.empty()) walls.emplace();
    for (const SemanticLabel& label : labels) {
      if (IsWallLike(label.name)) walls->insert(static_cast<uint32_t>(label.id));
    }
    if (walls.has_value() && walls->empty()) walls.reset();
    return std::make_unique<MeshSight>(snapshot, std::move(blocks), std::move(walls), stop);
  }
  NodeFilter filter;
  filter.kind = kinds::kStructure;
  std::vector<Node> walls;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes(filter, NodeId(), stop, [&](const Node& node) {
    const bool is_wall = IsWallLike(node.class_name) ||
                         (node.structure.has_value() && IsWallLike(node.structure->structure_type));
    if (is_wall && !node.box_node.isEmpty()) walls.push_back(node);
    return true;
  }));
  if (walls.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     "line_of_sight is true, but this map has neither a mesh nor walls that could "
                     "stand between two agents; ask without it",
                     {{"field", "line_of_sight"}, {"value", "true"}});
  }
  return std::make_unique<WallBoxes>(std::move(walls));
}

}  // namespace dsg::query
