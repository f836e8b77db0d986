// SPDX-License-Identifier: Apache-2.0
// What pictures of a camera show of a map, read once; and who was where at an instant.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/store/snapshot.h"

namespace dsg::ingest {

/// An agent that has poses.
struct SceneAgent {
  Node node;
  /// Among the agents with poses, ascending by id: its colour is the same in all pictures.
  size_t index = 0;
  TimeNs gap_ns = 0;
};

/// An agent at an instant.
struct SeenAgent {
  const SceneAgent* agent = nullptr;
  Pose3d map_T_agent;
  /// Where it was before, up to the instant; a new piece after each gap. Map frame.
  std::vector<std::vector<Eigen::Vector3d>> trail;
  /// Of the shape nearest in time, in the agent's frame, metres; empty if none is near.
  std::vector<Eigen::Vector3d> joints;
};

/// Threads: many readers.
class MapScene {
 public:
  /// `robot`: id or name; empty = the first robot with poses.
  /// Errors: NOT_FOUND/AGENT_UNKNOWN for a robot that is not there or has no poses; what the store
  /// returns. Cost: nodes and mesh of the whole map.
  static absl::StatusOr<MapScene> Read(std::shared_ptr<const Snapshot> snapshot,
                                       const std::string& robot);

  const Snapshot& snapshot() const { return *snapshot_; }
  const SceneAgent& robot() const { return agents_[robot_]; }
  /// Objects and rooms.
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<MeshBlock>& mesh() const { return mesh_; }

  /// nullopt before and after the robot's track, and in its gaps.
  absl::StatusOr<std::optional<Pose3d>> RobotAt(TimeNs at_ns) const;
  /// Everybody else, with trails of `trail_ns`.
  absl::StatusOr<std::vector<SeenAgent>> OthersAt(TimeNs at_ns, TimeNs trail_ns) const;

 private:
  explicit MapScene(std::shared_ptr<const Snapshot> snapshot) : snapshot_(std::move(snapshot)) {}
  absl::Status ReadAgents(const std::string& robot);
  absl::Status ReadTrail(TimeNs at_ns, TimeNs trail_ns, SeenAgent* seen) const;
  absl::Status ReadJoints(TimeNs at_ns, SeenAgent* seen) const;

  std::shared_ptr<const Snapshot> snapshot_;
  std::vector<Node> nodes_;
  std::vector<MeshBlock> mesh_;
  std::vector<SceneAgent> agents_;
  /// Index into agents_.
  size_t robot_ = 0;
};

}  // namespace dsg::ingest
