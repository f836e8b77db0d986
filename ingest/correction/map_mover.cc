// SPDX-License-Identifier: Apache-2.0
#include "ingest/correction/map_mover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "schema/model/rigid_motion.h"

namespace dsg::ingest {

namespace {

constexpr double kCellM = 0.5;
// Around a box: first what touches it, then further out.
constexpr double kMarginsM[] = {0.5, 1.0, 2.0, 4.0};

}  // namespace

double YawOf(const Eigen::Quaterniond& rotation) {
  return 2.0 * std::atan2(rotation.z(), rotation.w());
}

Eigen::Quaterniond TurnAboutZ(double yaw_rad) {
  return {std::cos(0.5 * yaw_rad), 0.0, 0.0, std::sin(0.5 * yaw_rad)};
}

void MapShift::Add(const Eigen::Vector3d& old_map, const Eigen::Vector3d& new_map, double yaw_rad) {
  Cell& cell = cells_[BlockOf(old_map.cast<float>(), kCellM)];
  ++cell.count;
  cell.old_sum += old_map;
  cell.shift_sum += new_map - old_map;
  cell.yaw_sum_rad += std::remainder(yaw_rad, 2.0 * M_PI);
}

MapShift::Cell MapShift::SumOf(const Box3d& box_map) const {
  const BlockIndex low = BlockOf(box_map.min().cast<float>(), kCellM);
  const BlockIndex high = BlockOf(box_map.max().cast<float>(), kCellM);
  Cell sum;
  // Cells are sorted by x first.
  for (auto it = cells_.lower_bound({low.x, INT32_MIN, INT32_MIN}); it != cells_.end(); ++it) {
    const auto& [index, cell] = *it;
    if (index.x > high.x) break;
    if (index.y < low.y || index.y > high.y || index.z < low.z || index.z > high.z) continue;
    sum.count += cell.count;
    sum.old_sum += cell.old_sum;
    sum.shift_sum += cell.shift_sum;
    sum.yaw_sum_rad += cell.yaw_sum_rad;
  }
  return sum;
}

std::optional<Pose3d> MapShift::Around(const Box3d& box_map) const {
  for (const double margin_m : kMarginsM) {
    const Box3d wide(box_map.min().array() - margin_m, box_map.max().array() + margin_m);
    const Cell sum = SumOf(wide);
    if (sum.count == 0) continue;
    const auto count = static_cast<double>(sum.count);
    const Eigen::Vector3d middle = sum.old_sum / count;
    const Eigen::Quaterniond turn = TurnAboutZ(sum.yaw_sum_rad / count);
    // The turn is about the middle of what was summed, where the mean shift holds.
    return Pose3d{middle + sum.shift_sum / count - turn * middle, turn};
  }
  return std::nullopt;
}

namespace {

using Position = std::array<float, 3>;

// Which optional channels the whole mesh keeps: those that every block has.
struct Channels {
  bool has_normals = true;
  bool has_colors = true;
  bool has_labels = true;
  bool has_instances = true;
  bool has_times = true;
};

Channels ChannelsOf(const std::vector<const MeshBlock*>& mesh) {
  Channels channels;
  for (const MeshBlock* block : mesh) {
    if (block->positions_map.empty()) continue;
    channels.has_normals &= !block->normals_map.empty();
    channels.has_colors &= !block->colors.empty();
    channels.has_labels &= !block->labels.empty();
    channels.has_instances &= !block->instance_ids.empty();
    channels.has_times &= !block->first_seen_ns.empty() && !block->last_seen_ns.empty();
  }
  return channels;
}

// One mesh of many blocks, in which vertices that blocks repeat stand once: they would come apart
// where one block was made later than its neighbour and knows later times.
class WeldedMesh {
 public:
  explicit WeldedMesh(const Channels& channels) : channels_(channels) {}

  void Add(const MeshBlock& block) {
    std::vector<uint32_t> whole_of_local;
    whole_of_local.reserve(block.positions_map.size());
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3f& position = block.positions_map[i];
      const auto next = static_cast<uint32_t>(whole_.positions_map.size());
      const auto [entry, is_new] =
          index_of_.try_emplace({position.x(), position.y(), position.z()}, next);
      whole_of_local.push_back(entry->second);
      if (is_new) {
        AddVertex(block, i);
      } else if (channels_.has_times) {
        TimeNs& first_ns = whole_.first_seen_ns[entry->second];
        TimeNs& last_ns = whole_.last_seen_ns[entry->second];
        first_ns = std::min(first_ns, block.first_seen_ns[i]);
        last_ns = std::max(last_ns, block.last_seen_ns[i]);
      }
    }
    for (const auto& [a, b, c] : block.faces) {
      const std::array<uint32_t, 3> face = {whole_of_local[a], whole_of_local[b],
                                            whole_of_local[c]};
      if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
      whole_.faces.push_back(face);
    }
  }

  MeshBlock Take() { return std::move(whole_); }

 private:
  void AddVertex(const MeshBlock& block, size_t i) {
    whole_.positions_map.push_back(block.positions_map[i]);
    if (channels_.has_normals) whole_.normals_map.push_back(block.normals_map[i]);
    if (channels_.has_colors) whole_.colors.push_back(block.colors[i]);
    if (channels_.has_labels) whole_.labels.push_back(block.labels[i]);
    if (channels_.has_instances) whole_.instance_ids.push_back(block.instance_ids[i]);
    if (!channels_.has_times) return;
    whole_.first_seen_ns.push_back(block.first_seen_ns[i]);
    whole_.last_seen_ns.push_back(block.last_seen_ns[i]);
  }

  const Channels channels_;
  MeshBlock whole_;
  // Asked one by one, never walked through: its order is not the same everywhere.
  absl::flat_hash_map<Position, uint32_t> index_of_;
};

// Vertices of one frame share their stamps: most of them ask for the same few instants.
class ChangeTable {
 public:
  explicit ChangeTable(const TrajectoryChange& change) : change_(change) {}

  Pose3d At(TimeNs time_ns) {
    const auto [entry, is_new] = change_at_.try_emplace(time_ns);
    if (is_new) entry->second = change_.At(time_ns);
    return entry->second;
  }

 private:
  const TrajectoryChange& change_;
  absl::flat_hash_map<TimeNs, Pose3d> change_at_;
};

MapShift MoveVertices(const TrajectoryChange& change, MeshBlock* mesh) {
  MapShift shift;
  ChangeTable changes(change);
  const bool has_times = !mesh->first_seen_ns.empty();
  for (size_t i = 0; has_times && i < mesh->positions_map.size(); ++i) {
    const Eigen::Vector3d old_map = mesh->positions_map[i].cast<double>();
    const Pose3d by_first = changes.At(mesh->first_seen_ns[i]);
    const Pose3d by_last = changes.At(mesh->last_seen_ns[i]);
    const Eigen::Vector3d new_map = 0.5 * (by_first * old_map + by_last * old_map);
    const Eigen::Quaterniond turn = by_first.orientation.slerp(0.5, by_last.orientation);
    mesh->positions_map[i] = new_map.cast<float>();
    if (!mesh->normals_map.empty()) {
      mesh->normals_map[i] = (turn * mesh->normals_map[i].cast<double>()).cast<float>();
    }
    shift.Add(old_map, new_map, YawOf(turn));
  }
  return shift;
}

}  // namespace

MovedMesh MoveMesh(const std::vector<const MeshBlock*>& mesh, const TrajectoryChange& change,
                   double block_size_m) {
  MovedMesh moved;
  if (change.IsIdentity()) return moved;
  WeldedMesh welded(ChannelsOf(mesh));
  std::set<BlockIndex> old_blocks;
  for (const MeshBlock* block : mesh) {
    old_blocks.insert(block->index);
    welded.Add(*block);
  }
  MeshBlock whole = welded.Take();
  moved.shift = MoveVertices(change, &whole);
  moved.blocks = SplitIntoBlocks(whole, block_size_m);
  for (const MeshBlock& block : moved.blocks) old_blocks.erase(block.index);
  moved.removed.assign(old_blocks.begin(), old_blocks.end());
  return moved;
}

namespace {

// Axes nearer to the vertical than this count as upright.
constexpr double kUprightCosine = 0.9998;

bool IsUpright(const Eigen::Quaterniond& orientation) {
  return (orientation * Eigen::Vector3d::UnitZ()).z() > kUprightCosine;
}

// The share of a rotation that a node without a tilt takes.
Pose3d Levelled(const Pose3d& new_T_old, const Eigen::Vector3d& at_map) {
  const Eigen::Quaterniond turn = TurnAboutZ(YawOf(new_T_old.orientation));
  return {new_T_old * at_map - turn * at_map, turn};
}

Pose3d ShiftAsRobot(const Eigen::Vector3d& at_map, const TrajectoryChange& change,
                    const std::vector<TimedPose>& robot) {
  double nearest_m2 = std::numeric_limits<double>::infinity();
  TimeNs time_ns = 0;
  for (const TimedPose& pose : robot) {
    const double distance_m2 = (pose.map_T_agent.position - at_map).squaredNorm();
    if (distance_m2 >= nearest_m2) continue;
    nearest_m2 = distance_m2;
    time_ns = pose.time_ns;
  }
  if (robot.empty()) return {};
  return Levelled(change.At(time_ns), at_map);
}

// new_T_old of one node.
Pose3d ShiftOf(const Node& node, const TrajectoryChange& change, const MapShift& shift,
               const std::vector<TimedPose>& robot) {
  if (node.first_observed_ns.has_value() && node.last_observed_ns.has_value()) {
    const Pose3d moved =
        MovePose(node.map_T_node, *node.first_observed_ns, *node.last_observed_ns, change);
    return KeepUpright(node.map_T_node, moved) * node.map_T_node.Inverse();
  }
  if (const std::optional<Pose3d> around = shift.Around(node.BoxMap())) return *around;
  return ShiftAsRobot(node.map_T_node.position, change, robot);
}

bool HoldsRooms(const Node& node) {
  return node.region.has_value() && node.layer != layers::kRooms;
}

// Buildings and levels are boxes around all that was found, and are made so again.
void BoxHolders(std::vector<Node>* nodes) {
  Box3d whole;
  for (const Node& node : *nodes) {
    if (!HoldsRooms(node)) whole.extend(node.BoxMap());
  }
  if (whole.isEmpty()) return;
  for (Node& node : *nodes) {
    if (!HoldsRooms(node)) continue;
    Box3d box = whole;
    if (node.layer != layers::kBuildings) {
      box.min().z() = node.region->z_min_m;
      box.max().z() = node.region->z_max_m;
    }
    node.map_T_node = {box.center(), Eigen::Quaterniond::Identity()};
    node.map_T_node.position.z() = box.min().z();
    node.box_node =
        Box3d(box.min() - node.map_T_node.position, box.max() - node.map_T_node.position);
    node.region->z_min_m = box.min().z();
    node.region->z_max_m = box.max().z();
    node.region->footprint_map = {{box.min().x(), box.min().y()},
                                  {box.max().x(), box.min().y()},
                                  {box.max().x(), box.max().y()},
                                  {box.min().x(), box.max().y()}};
  }
}

// Covariances by keyframe, shared by the poses around it.
class KeyframeCovariances {
 public:
  explicit KeyframeCovariances(const MovePosesOptions& options) : times_(options.keyframe_times) {
    for (const Covariance6& covariance : options.covariances) {
      shared_.push_back(std::make_shared<const Covariance6>(covariance));
    }
  }

  bool empty() const { return times_.empty() || shared_.size() != times_.size(); }

  const std::shared_ptr<const Covariance6>& Nearest(TimeNs time_ns) const {
    const auto after = std::lower_bound(times_.begin(), times_.end(), time_ns);
    auto index = static_cast<size_t>(after - times_.begin());
    const bool is_before_nearer =
        index == times_.size() || (index > 0 && time_ns - times_[index - 1] < *after - time_ns);
    if (is_before_nearer) --index;
    return shared_[index];
  }

 private:
  const std::vector<TimeNs>& times_;
  std::vector<std::shared_ptr<const Covariance6>> shared_;
};

}  // namespace

Pose3d MovePose(const Pose3d& map_T_thing, TimeNs first_ns, TimeNs last_ns,
                const TrajectoryChange& change) {
  const Pose3d by_first = change.At(first_ns) * map_T_thing;
  if (first_ns == last_ns) return by_first;
  return Interpolate(by_first, change.At(last_ns) * map_T_thing, 0.5);
}

Pose3d KeepUpright(const Pose3d& old_pose, const Pose3d& new_pose) {
  if (!IsUpright(old_pose.orientation)) return new_pose;
  const double yaw_rad = YawOf(new_pose.orientation * old_pose.orientation.conjugate());
  return {new_pose.position, (TurnAboutZ(yaw_rad) * old_pose.orientation).normalized()};
}

LayerGraph MoveGraph(LayerGraph graph, const TrajectoryChange& change, const MapShift& shift,
                     const std::vector<TimedPose>& robot) {
  if (change.IsIdentity()) return graph;
  for (Node& node : graph.nodes) {
    TransformNode(ShiftOf(node, change, shift, robot), &node);
  }
  BoxHolders(&graph.nodes);
  // Children moved apart from their parents.
  GraphDelta whole;
  whole.nodes = std::move(graph.nodes);
  whole.edges = std::move(graph.edges);
  FitBoxesToChildren(&whole);
  return {std::move(whole.nodes), std::move(whole.edges)};
}

std::vector<TimedPose> MovePoses(std::vector<TimedPose> poses, const TrajectoryChange& change,
                                 const MovePosesOptions& options) {
  if (change.IsIdentity()) return poses;
  const KeyframeCovariances covariances(options);
  for (TimedPose& pose : poses) {
    const Pose3d old_pose = pose.map_T_agent;
    if (!covariances.empty()) pose.covariance = nullptr;
    TransformPose(change.At(pose.time_ns), &pose);
    if (options.is_kept_upright) pose.map_T_agent = KeepUpright(old_pose, pose.map_T_agent);
    pose.flags |= pose_flags::kCorrected;
    if (!covariances.empty()) pose.covariance = covariances.Nearest(pose.time_ns);
  }
  return poses;
}

}  // namespace dsg::ingest
