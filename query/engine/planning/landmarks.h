// SPDX-License-Identifier: Apache-2.0
// Distances from a dozen far places to all others, so that a search knows how far a goal is around
// the walls and not only through them. They bound ways from below.
//
// Source: Goldberg, Harrelson, "Computing the shortest path: A* search meets graph theory", SODA
// 2005: by the triangle inequality no way is shorter than the difference of the distances of its
// ends to any third place.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/planning/ends.h"
#include "query/view/place_graph.h"
#include "schema/base/cache.h"

namespace dsg::query {

inline constexpr int kLandmarkCount = 12;

/// Distances under limits that are no tighter than a question's: where more is admitted, ways are
/// no longer, so the bounds hold.
///
/// Threads: immutable.
class Landmarks {
 public:
  using Distances = std::array<float, kLandmarkCount>;

  /// Errors: what `stop` returned. Cost: a dozen searches over the whole graph.
  static absl::StatusOr<std::shared_ptr<const Landmarks>> Build(const PlaceGraph& graph,
                                                                const Limits& limits,
                                                                const StopCheck& stop);

  /// Metres. Meaningless between places of different components, and where there is none.
  const Distances& of(PlaceIndex place) const { return distances_[static_cast<size_t>(place)]; }
  /// Which places can reach each other; -1 for places that the limits do not admit.
  int32_t component(PlaceIndex place) const { return components_[static_cast<size_t>(place)]; }
  int32_t component_count() const { return component_count_; }
  /// The largest rounding error of a difference of two distances, metres.
  double slack_m() const { return slack_m_; }

  size_t memory_bytes() const;

 private:
  friend class LandmarkBuilder;

  std::vector<Distances> distances_;
  std::vector<int32_t> components_;
  int32_t component_count_ = 0;
  double slack_m_ = 0.0;
};

/// The landmarks of one graph, a few sets of them: for the present and for other times, and for
/// classes of robot radius.
///
/// Threads: safe from many threads. One builds, who needs the same waits within their own stop.
class LandmarkCache {
 public:
  /// Landmarks that bound the ways under `limits` well.
  /// Errors: what `stop` returned.
  absl::StatusOr<std::shared_ptr<const Landmarks>> Get(const PlaceGraph& graph,
                                                       const Limits& limits, const StopCheck& stop);

  size_t memory_bytes() const;

 private:
  struct Key {
    int64_t radius_class = 0;
    bool present = false;
    bool operator==(const Key&) const = default;
  };
  struct Entry {
    Key key;
    std::shared_ptr<const Landmarks> landmarks;
    uint64_t used = 0;
  };

  std::optional<std::shared_ptr<const Landmarks>> Find(const Key& key);
  /// Keeps what it builds, in place of the set that was not used for the longest.
  absl::StatusOr<std::shared_ptr<const Landmarks>> Build(const PlaceGraph& graph, const Key& key,
                                                         const StopCheck& stop);

  SingleFlight<Key> flights_;
  mutable std::mutex mutex_;
  uint64_t use_count_ = 0;
  std::vector<Entry> entries_;
};

/// How far it is at least from a place to the nearest goal. Never overestimates, and what it says
/// of two neighbours never differs by more than the length of the link between them.
///
/// Threads: one search at a time.
class Guide {
 public:
  /// Straight lines only if `landmarks` is null. The arguments must outlive it.
  /// Requires: at least one goal, and only goals that landmarks have a component for.
  Guide(const PlaceGraph& graph, const std::vector<Anchor>& goals, const Landmarks* landmarks);

  /// False if the place is in no component of a goal. Always true without landmarks.
  bool MayReach(PlaceIndex place) const;
  /// Metres. Requires: MayReach.
  double AtLeast(PlaceIndex place) const;

 private:
  // Goals that are bounded together: exact for one, looser the further apart they are.
  struct Group {
    int32_t component = 0;
    Box3d box;
    double way_m = 0.0;
    Landmarks::Distances low;
    Landmarks::Distances high;
  };

  double StraightFrom(PlaceIndex place, const Group& group) const;
  void Extend(const Anchor& goal, Group* group) const;
  int32_t ComponentOf(PlaceIndex place) const {
    return landmarks_ == nullptr ? 0 : landmarks_->component(place);
  }

  const PlaceGraph& graph_;
  const Landmarks* landmarks_;
  // Ascending component.
  std::vector<Group> groups_;
};

}  // namespace dsg::query
