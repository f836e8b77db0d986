// SPDX-License-Identifier: Apache-2.0
// What a map says of the world, as plain data: all that the evaluation scores.
// Refuses to know the truth.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/evaluation/objects.h"
#include "ingest/evaluation/places.h"
#include "ingest/evaluation/relations.h"
#include "ingest/evaluation/rooms.h"
#include "ingest/evaluation/trajectory.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"

namespace dsg::evaluation {

/// A pose that a track holds, or the detection behind one.
struct TrackedTorso {
  TimeNs time_ns = 0;
  /// Index among the people's tracks, by node id.
  int track = 0;
  Eigen::Vector3d torso_map = Eigen::Vector3d::Zero();
};

/// A stored body of a track that has a pose at that stamp.
struct TrackedBody {
  TimeNs time_ns = 0;
  int track = 0;
  Pose3d map_T_torso;
  /// x y z each, against the pelvis, axes of the torso, metres; either may be empty.
  std::vector<float> joints;
  std::vector<float> vertices;
};

/// An edge HELD_BY.
struct Holding {
  /// Index in Estimate::objects; -1 when the source is no object.
  int object = -1;
  int track = -1;
  TimeNs from_ns = 0;
  double probability = 0.0;
};

struct Estimate {
  std::string map;
  Revision revision = 0;
  /// The robot's poses as first committed, and as believed at the revision.
  std::vector<StampedPose> robot_causal;
  std::vector<StampedPose> robot;
  /// All blocks as one.
  MeshBlock mesh;
  std::vector<SemanticLabel> labels;
  /// Without the predicted ones.
  std::vector<TrackedTorso> torsos;
  std::vector<TrackedTorso> detection_priors;
  std::vector<TrackedBody> bodies;
  std::vector<EstimatedObject> objects;
  std::vector<EstimatedPlace> places;
  std::vector<PlaceEdge> place_edges;
  /// For each place its room; -1 = none.
  std::vector<int> room_of_place;
  int room_count = 0;
  std::vector<RoomPair> adjacent_rooms;
  std::vector<Holding> holdings;
  /// From object to object or structure, of those that hold at the end.
  std::vector<EstimatedRelation> relations;
  /// What a reader of the figures should know.
  std::vector<std::string> notes;
};

/// Brings all of the map into another frame. Boxes stay along the axes, and so grow where they are
/// turned. Covariances of poses stay as they are: only NEES looks at them, and takes poses as they
/// were committed.
void MoveEstimate(const Pose3d& new_T_map, Estimate* estimate);

}  // namespace dsg::evaluation
