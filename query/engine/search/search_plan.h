// SPDX-License-Identifier: Apache-2.0
// How the nodes of a pattern are found: from the cheapest index that holds all of them, then by
// looking at each. Refuses to let the way chosen show in the answer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/search/matcher.h"
#include "query/engine/search/pattern.h"

namespace dsg::query {

/// A step that was done. Same meaning as v1.SearchStep.
struct PlanStep {
  std::string operation;
  std::string detail;
  int64_t in_count = 0;
  int64_t out_count = 0;
};

/// Where candidates come from.
struct PlanStart {
  enum class Kind { kNothing, kId, kClass, kLayer, kBox, kJoin, kName, kScan };
  Kind kind = Kind::kScan;
  /// Of kJoin: which relation of the pattern.
  size_t relation = 0;
  /// Nodes that will be touched, an estimate.
  double cost = 0.0;
};

/// Threads: one caller at a time.
class Planner {
 public:
  /// Both must outlive this. `steps` may be null.
  Planner(const GraphView& view, Matcher* matcher, std::vector<PlanStep>* steps)
      : view_(view), matcher_(matcher), steps_(steps) {}

  /// `box_map`: nodes must touch it, agents do not count.
  PlanStart ChooseStart(const CompiledPattern& pattern, const std::optional<Box3d>& box_map) const;

  /// Ids above `after` that `start` finds: all that match, and others. Ascending.
  std::vector<NodeId> Candidates(const CompiledPattern& pattern, const PlanStart& start,
                                 const std::optional<Box3d>& box_map, NodeId after);

  /// All that match, wherever they are. Ascending.
  std::vector<NodeId> Collect(const CompiledPattern& pattern);

 private:
  double EstimateMatches(const CompiledPattern& pattern) const;
  int64_t CountInLayer(LayerId layer) const;
  std::optional<PlanStart> BoxStart(const CompiledPattern& pattern,
                                    const std::optional<Box3d>& box_map, double best_cost) const;
  std::vector<NodeId> Join(const CompiledPattern& pattern, const CompiledRelation& relation);
  void AddStep(const char* operation, std::string detail, int64_t in_count, int64_t out_count);

  const GraphView& view_;
  Matcher* matcher_;
  std::vector<PlanStep>* steps_;
};

/// The layer and the class that an index of space can be narrowed to.
SpaceFilter SpaceFilterOf(const CompiledPattern& pattern);

}  // namespace dsg::query
