// SPDX-License-Identifier: Apache-2.0
// A search from start to end: one page of nodes, by id or nearest first, with the steps it took.
// Nothing is kept between pages: where a page begins is all that the next one needs.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/search/pattern.h"

namespace dsg::query {

/// Orders hits: by distance, then id. Without a point to be near to, all distances are 0.
struct HitKey {
  double distance_m = 0.0;
  NodeId id;
  auto operator<=>(const HitKey&) const = default;
};

struct Hit {
  HitKey key;
  /// Of agents in a search at an instant: where they were then.
  std::optional<Pose3d> map_T_agent;
  /// Of an agent then in a gap of its track: nobody knows where.
  bool is_in_gap = false;
  std::vector<NodeId> related;
};

struct SearchQuestion {
  Pattern pattern;
  /// Of the view's revision: it knows where agents stayed. Null = nowhere.
  const Snapshot* snapshot = nullptr;
  /// nullopt: at any time.
  std::optional<TimeNs> at_ns;
  std::optional<Eigen::Vector3d> near_map;
  double distance_m_max = std::numeric_limits<double>::infinity();
  std::optional<Box3d> box_map;
  /// Where an agent was at at_ns; nullopt if it was not there. Asked only if at_ns is set.
  std::function<absl::StatusOr<std::optional<LocatedPose>>(NodeId agent)> locate;
  std::optional<HitKey> after;
  int limit = 1;
  /// Only SearchAnswer::hit_count; `after` and `limit` mean nothing.
  bool count_only = false;
  bool explain = false;
};

/// A step that was done. Same meaning as v1.SearchStep.
struct PlanStep {
  std::string operation;
  std::string detail;
  int64_t in_count = 0;
  int64_t out_count = 0;
};

struct SearchAnswer {
  /// Ascending by key.
  std::vector<Hit> hits;
  bool has_more = false;
  int64_t hit_count = 0;
  /// Empty unless asked for.
  std::vector<PlanStep> steps;
};

/// Agents have no place of their own: at an instant they are where their tracks put them, or not
/// found. With a point or a box only patterns that ask for agents find them.
/// Requires: at_ns is set if such a pattern has a point or a box.
///
/// Errors: those of `locate`; what `stop` returned.
absl::StatusOr<SearchAnswer> RunSearch(const GraphView& view, const SearchQuestion& question,
                                       const StopCheck& stop);

/// All nodes that match at an instant, agents included; nullopt: at any time, each condition for
/// itself. For the present give kTimeMax - 1. `snapshot` as in SearchQuestion. Ascending id.
/// Errors: of the store; what `stop` returned.
absl::StatusOr<std::vector<NodeId>> FindMatches(const GraphView& view, const Pattern& pattern,
                                                const Snapshot* snapshot,
                                                std::optional<TimeNs> at_ns, const StopCheck& stop);

}  // namespace dsg::query
