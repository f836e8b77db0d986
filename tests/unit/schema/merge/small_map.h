// SPDX-License-Identifier: Apache-2.0
// Maps of a few nodes in a real store, and merges of them, in one line each.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "schema/merge/merge.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

Node MakeObject(uint64_t index, const std::string& class_name, const Eigen::Vector3d& at,
                double size_m = 0.5);
Node MakePlace(uint64_t index, const Eigen::Vector3d& at, double clearance_m);
/// A room of `size` with its corner at `low`.
Node MakeRoom(uint64_t index, const Eigen::Vector3d& low, const Eigen::Vector3d& size);
Node MakeAgent(NodeId id, const std::string& name);
Edge MakeEdge(NodeId source, const std::string& relation, NodeId target);
TrajectoryAppend MakeTrack(NodeId agent, TimeNs from_ns, int pose_count);

inline NodeId O(uint64_t index) { return NodeId('O', index); }
inline NodeId P(uint64_t index) { return NodeId('p', index); }
inline NodeId R(uint64_t index) { return NodeId('R', index); }

inline constexpr NodeId kAnna('H', 1);

GraphDelta OfNode(Node node);

class SmallMaps {
 public:
  SmallMaps();

  GraphStore* store() { return store_.get(); }
  /// Makes the map at the first call; sequences count on. Fails the test on errors.
  Revision Commit(const std::string& map, GraphDelta delta);
  std::shared_ptr<const Snapshot> Newest(const std::string& map);
  Node Get(const std::string& map, NodeId id);
  bool Has(const std::string& map, const EdgeKey& key);

  absl::StatusOr<merge::MergePlan> Plan(const std::string& into, const std::string& other,
                                        const Pose3d& map_T_other = {},
                                        merge::MergeOptions options = {});
  /// Commits at most `delta_count_max` deltas of the plan; returns how many.
  int Write(const std::string& into, const std::string& other, merge::MergePlan plan,
            int delta_count_max = 1000);
  /// Plans and writes.
  merge::MergePlan Merge(const std::string& into, const std::string& other,
                         const Pose3d& map_T_other = {}, merge::MergeOptions options = {});
  /// Of `dsg verify`.
  std::vector<std::string> Problems(const std::string& map);

 private:
  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};

}  // namespace dsg::test
