// SPDX-License-Identifier: Apache-2.0
// Moves what hung on keyframes that a loop closure has moved: nodes, mesh, timed poses.
// Refuses to look again at the log: what was merged wrongly before stays merged.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "ingest/commit/graph_told.h"
#include "ingest/loop/robot_graph.h"
#include "schema/model/geometry.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// What was seen from first_ns to last_ns moves halfway between the changes at both instants: a
/// wall that was passed twice was merged from both passes.
Pose3d MovePose(const Pose3d& map_T_thing, TimeNs first_ns, TimeNs last_ns,
                const TrajectoryChange& change);

/// Takes what tilts a thing out of its move, if it stood upright before: gravity was known all
/// along.
Pose3d KeepUpright(const Pose3d& old_pose, const Pose3d& new_pose);

/// The turn of a rotation about the vertical, radians.
double YawOf(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond TurnAboutZ(double yaw_rad);

/// How the mesh moved, place by place: what has no time of its own moves with the mesh around it.
/// Shifts turn about the vertical only.
///
/// Threads: one caller at a time while it is filled, then safe.
class MapShift {
 public:
  /// A piece of surface was there and is now here.
  void Add(const Eigen::Vector3d& old_map, const Eigen::Vector3d& new_map, double yaw_rad);

  /// The mean shift of the mesh in and near a box; nullopt without mesh within 4 m.
  std::optional<Pose3d> Around(const Box3d& box_map) const;

 private:
  struct Cell {
    int64_t count = 0;
    Eigen::Vector3d old_sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d shift_sum = Eigen::Vector3d::Zero();
    double yaw_sum_rad = 0.0;
  };
  Cell SumOf(const Box3d& box_map) const;

  std::map<BlockIndex, Cell> cells_;
};

struct MovedMesh {
  /// Ascending by index.
  std::vector<MeshBlock> blocks;
  /// Blocks of before in which nothing is left, ascending.
  std::vector<BlockIndex> removed;
  /// For what has no time of its own.
  MapShift shift;
};

/// Each vertex by when it was seen, normals turned, faces in the blocks where they are now.
/// Vertices that stand in several blocks move as one, by the earliest and latest of their times.
/// Channels that not all blocks have are dropped; a mesh without times stays where it is.
/// `block_size_m`: the map's. Deterministic.
MovedMesh MoveMesh(const std::vector<const MeshBlock*>& mesh, const TrajectoryChange& change,
                   double block_size_m);

/// Nodes with times of observation move by those, others with the mesh around them, or, where there
/// is no mesh, as the robot did when it was nearest. Upright things stay upright. Rooms' outlines
/// turn and do not bend; buildings and levels take the box of what they contain. Edges stay.
/// `robot`: its poses before.
LayerGraph MoveGraph(LayerGraph graph, const TrajectoryChange& change, const MapShift& shift,
                     const std::vector<TimedPose>& robot);

struct MovePosesOptions {
  /// As KeepUpright, for people.
  bool is_kept_upright = false;
  /// Covariances of the corrected robot, by keyframe; each pose takes that of the nearest keyframe.
  /// Empty = poses keep theirs, turned.
  std::vector<TimeNs> keyframe_times;
  std::vector<Covariance6> covariances;
};

/// Poses by their own times, flagged kCorrected.
std::vector<TimedPose> MovePoses(std::vector<TimedPose> poses, const TrajectoryChange& change,
                                 const MovePosesOptions& options);

}  // namespace dsg::ingest
