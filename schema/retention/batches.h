// SPDX-License-Identifier: Apache-2.0
// The changes of a prune plan as deltas of bounded size, each of which leaves a consistent map.
// Changes that others have made since the plan win; Others finds what of an erasure has to be
// planned again because of them.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/retention/plan.h"

namespace dsg {

struct BatchHeader {
  std::string map;
  /// Must be new with each plan.
  std::string session_id;
  std::string author;
  /// "prune NAME"; ", part 1" and so on is added.
  std::string message;
};

/// Rows of one delta.
inline constexpr size_t kPruneBatchRows = 5'000;

/// Order: meshes; then agent by agent shapes, factors and poses; stays; nodes, children before
/// parents, each with its edges. Cut off at any point, the same policies find the rest.
///
/// Threads: one caller at a time.
class PruneBatches {
 public:
  /// `at_plan`: the map at the revision of the plan.
  PruneBatches(std::shared_ptr<const Snapshot> at_plan, PrunePlan plan, BatchHeader header);
  ~PruneBatches();

  /// The next delta; nullopt when all is done. `head`: the map as it is now.
  absl::StatusOr<std::optional<GraphDelta>> Next(const Snapshot& head, const StopCheck& stop);

  /// Others have changed these: what is left of the plan for them is dropped.
  void Avoid(const Touched& touched);

  /// From 0 to 1.
  double progress() const;
  const PrunePlan& plan() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

struct Contested {
  /// Whose tracks were corrected, or who are there again.
  std::set<NodeId> agents;
  std::set<BlockIndex> mesh_blocks;

  bool empty() const { return agents.empty() && mesh_blocks.empty(); }
  size_t size() const { return agents.size() + mesh_blocks.size(); }
  /// Names of at most so many: ids, and x,y,z of blocks.
  std::vector<std::string> Names(size_t count_max) const;
};

/// Gathers what others touch from the revision of a plan on.
class Others {
 public:
  void Add(const Touched& touched);
  /// What of it the plan was to change, as far as it is to be erased.
  Contested FindContested(const PrunePlan& plan, const Erasure& erasure) const;

  const std::set<NodeId>& nodes() const { return nodes_; }

 private:
  std::set<NodeId> nodes_;
  std::set<NodeId> tracks_;
  std::set<BlockIndex> mesh_blocks_;
};

}  // namespace dsg
