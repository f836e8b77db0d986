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
  /// Unique per plan.
  std::string session_id;
  std::string author;
  /// "prune NAME"; each delta appends ", part 1" and so on.
  std::string message;
};

/// Rows of one delta.
inline constexpr size_t kPruneBatchRows = 5'000;

/// Order: meshes; then shapes, factors and poses by agent; stays; nodes, children before parents,
/// each with its edges. After an interruption at any point the same policies find the rest.
///
/// Threads: one caller at a time.
class PruneBatches {
 public:
  /// `at_plan`: the map at the revision of the plan.
  PruneBatches(std::shared_ptr<const Snapshot> at_plan, PrunePlan plan, BatchHeader header);
  ~PruneBatches();

  /// The next delta; nullopt at the end. `head`: the present map.
  absl::StatusOr<std::optional<GraphDelta>> Next(const Snapshot& head, const StopCheck& stop);

  /// Drops the rest of the plan for what others have changed.
  void Avoid(const Touched& touched);

  /// From 0 to 1.
  double progress() const;
  const PrunePlan& plan() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

struct Contested {
  /// Agents whose tracks were corrected, or who were created again.
  std::set<NodeId> agents;
  std::set<BlockIndex> mesh_blocks;

  bool empty() const { return agents.empty() && mesh_blocks.empty(); }
  size_t size() const { return agents.size() + mesh_blocks.size(); }
  /// Names of at most `count_max` of them: ids, and x,y,z of blocks.
  std::vector<std::string> Names(size_t count_max) const;
};

/// Collects what others have changed since the revision of a plan.
class Others {
 public:
  void Add(const Touched& touched);
  /// The part of it that the plan changes and `erasure` erases. Not nodes other than agents: their
  /// past is erased in any case.
  Contested FindContested(const PrunePlan& plan, const Erasure& erasure) const;

  const std::set<NodeId>& nodes() const { return nodes_; }

 private:
  std::set<NodeId> nodes_;
  std::set<NodeId> tracks_;
  std::set<BlockIndex> mesh_blocks_;
};

}  // namespace dsg
