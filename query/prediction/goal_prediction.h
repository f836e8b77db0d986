// SPDX-License-Identifier: Apache-2.0
// Where someone who was seen to walk will be if they walk to one of the goals of a graph of places.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "query/prediction/velocity.h"
#include "query/prediction/walk_space.h"
#include "schema/base/stop_check.h"

namespace dsg::query {

/// Places that people go to, with what is known of how often before the path was seen.
struct Goal {
  int place = 0;
  double prior = 1.0;
};

/// Found on simulated people of development logs, who take short ways at an even pace.
struct GoalOptions {
  /// Metres of detour that make a goal e times less likely; 1 m is more cautious.
  double detour_m = 0.3;
  /// The futures that are given, most probable first.
  int path_count_max = 6;
  double look_ahead_m = 1.2;
  /// Constant velocity rules for so long at first.
  double blend_s = 2.0;
  /// Kept from obstacles wherever corners are cut.
  double clearance_m_min = 0.25;
  double sigma_m_s = 0.25;
  double decay = 0.1;
  /// Futures that are never further apart than this are one.
  double merge_m = 2.0;
  /// Someone slower than this stands, and stays: where they turn to is not known yet.
  double standing_m_s = 0.1;
  /// Who is further than this from every place and link is not on the graph.
  double attach_m_max = 1.0;
  /// How sharply people walk towards where they are going: a way that begins at an angle to their
  /// velocity is less likely by exp(heading * (cos(angle) - 1)).
  double heading = 10.0;
  /// Kept from what is not known to be free where links are left for a straight line.
  double straight_m_min = 0.15;
  /// Goals with a longer way than this are not thought of.
  double way_m_max = 30.0;
  /// The pace of a walk, which those who set out will reach; 0 = nobody speeds up. At most 3 m / s.
  double walking_m_s = 1.15;
  /// A step that differs by more than this from the one before tells of a change: who slows down is
  /// about to stop, who speeds up is setting out. Smaller ones are noise of detections.
  double pace_change_m_s_min = 0.2;
};

/// A graph with its goals, arranged once and asked for everybody.
///
/// Threads: not changed after construction, so any number may read. Cost: links + some dozen times
/// places, once; copies share all but the goals.
class GoalField {
 public:
  struct Neighbour {
    int place = 0;
    double way_m = 0.0;
  };

  /// Requires: links and goals name places; clearances and priors finite and not negative.
  /// Errors: what `stop` returned.
  static absl::StatusOr<GoalField> Make(WalkGraph graph, std::vector<Goal> goals,
                                        const StopCheck& stop);
  /// The same without an end before it is done.
  GoalField(WalkGraph graph, std::vector<Goal> goals);
  /// The same graph with other goals.
  GoalField WithGoals(std::vector<Goal> goals) const;

  const WalkGraph& graph() const { return ground_->graph; }
  const std::vector<Goal>& goals() const { return goals_; }
  const FreeSpace& free_space() const { return ground_->free_space; }
  const WalkIndex& index() const { return ground_->index; }
  /// In the order of the links.
  std::span<const Neighbour> Neighbours(int place) const {
    const std::vector<size_t>& offsets = ground_->offsets;
    return std::span(ground_->neighbours)
        .subspan(offsets[place], offsets[place + 1] - offsets[place]);
  }
  size_t memory_bytes() const;

 private:
  struct Ground {
    WalkGraph graph;
    FreeSpace free_space;
    WalkIndex index;
    std::vector<size_t> offsets;
    std::vector<Neighbour> neighbours;
  };

  GoalField() = default;

  std::shared_ptr<const Ground> ground_;
  std::vector<Goal> goals_;
};

/// The probability of each goal of the field, by the rule below; they sum to one, or are all zero
/// when no goal can be reached from the path.
std::vector<double> GoalProbabilities(const std::vector<PathPoint>& path, const GoalField& field,
                                      const GoalOptions& options);

/// Walks on the graph to the most likely goals; paths stay on links, hence out of walls.
///
/// Ways are as straight as the clearances of places allow, elsewhere they follow links.
/// Probability of a goal: prior * exp(heading * (cos(angle) - 1)) * exp(-(way walked + way left -
/// way at first) / detour), ways on the graph, scaled to sum to one. Goals that lead the same way
/// until the last time asked for are one future with the sum of their probabilities; what is
/// missing to one went to futures beyond `path_count_max` and to goals of less than 0.1 %. From the
/// last point to the graph the way goes straight to a place within whose clearance the point lies;
/// only where there is none, to the nearest link, which nothing proves to be on this side of a
/// wall. Nobody walks at a speed that changes for ever: who slows down is taken to stop, who speeds
/// up from below the pace of a walk to reach it. Cost: two searches of ways up to twice
/// `way_m_max`, whatever the number of goals.
/// Without places near the path: constant velocity alone. Near places but without a way to any
/// goal: constant velocity that waits where it leaves their clearances. Requires: as
/// PredictConstantVelocity; `clearance_m_min` at least 0.05. Errors: what `stop` returned.
absl::StatusOr<std::vector<PredictedPath>> PredictToGoals(const std::vector<PathPoint>& path,
                                                          const std::vector<TimeNs>& at_ns,
                                                          const GoalField& field,
                                                          const GoalOptions& options,
                                                          const StopCheck& stop);

/// The same without an end before it is done.
std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const GoalField& field,
                                          const GoalOptions& options);

/// The same for a graph that is asked once.
std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const WalkGraph& graph,
                                          const std::vector<Goal>& goals,
                                          const GoalOptions& options);

/// Waits from where a path leaves what is known to be free: the clearances of places of its storey.
/// Nothing is known where there is no place, so that a path which begins outside all waits at once.
/// Errors: what `stop` returned.
absl::Status StopAtEdge(const PathPoint& last, const WalkGraph& graph, const StopCheck& stop,
                        PredictedPath* predicted);

}  // namespace dsg::query
