// SPDX-License-Identifier: Apache-2.0
// What of a plan that erases others wrote while it was carried out, so that it has to be planned
// again. Refuses to mind nodes that are no agents: what is written of them anew is believed, and
// their past goes all the same.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "schema/retention/plan.h"

namespace dsg {

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
