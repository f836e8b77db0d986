// SPDX-License-Identifier: Apache-2.0
// Where someone who was seen to walk will be.
// Refuses to know stores and requests: paths and graphs of places come as plain numbers.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "schema/base/time.h"

namespace dsg::query {

/// A position that was observed. Ascending in time.
struct PathPoint {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
};

/// Metres per second.
struct Velocity {
  Eigen::Vector3d velocity_map = Eigen::Vector3d::Zero();
  /// From how many steps; 0 = nothing known, and zero.
  int step_count = 0;
};

/// Of the last step alone. Points of one time are one point, the last of them.
/// Source: Schoeller et al. 2020 (constant velocity).
/// Requires, as everything here: finite positions, times that never go back.
Velocity LastVelocity(const std::vector<PathPoint>& path);

/// Of at most the last seven steps, the last one counts most: weight decay^age.
/// Requires: `decay` from 0 (the last step alone) to 1 (all alike).
Velocity SmoothedVelocity(const std::vector<PathPoint>& path, double decay);

/// One possible future.
struct PredictedPath {
  double probability = 1.0;
  /// At the asked times.
  std::vector<Eigen::Vector3d> positions_map;
  /// Standard deviation of each position, metres, on each axis.
  std::vector<double> sigma_m;
};

struct ConstantVelocityOptions {
  /// Of SmoothedVelocity; 0 = the last step alone.
  double decay = 0.0;
  /// The velocity shrinks by this factor a second; 1 = constant.
  double damping = 1.0;
  /// Growth of the standard deviation, m / s.
  double sigma_m_s = 0.25;
};

/// Someone of one point stands still.
/// Requires: at least one point; `at_ns` ascending, not before the last point.
PredictedPath PredictConstantVelocity(const std::vector<PathPoint>& path,
                                      const std::vector<TimeNs>& at_ns,
                                      const ConstantVelocityOptions& options);

/// Where people can walk, as points and links.
struct WalkGraph {
  std::vector<Eigen::Vector3d> places_map;
  /// Distance to the nearest obstacle at each place, metres.
  std::vector<double> clearance_m;
  /// Undirected, by index.
  std::vector<std::pair<int, int>> links;
};

/// Places that people go to, with what is known of how often before the path was seen.
struct Goal {
  int place = 0;
  double prior = 1.0;
};

struct GoalOptions {
  /// Metres of detour that make a goal e times less likely. Found on simulated people, who take the
  /// shortest way; 1 m is more cautious.
  double detour_m = 0.3;
  /// The futures that are given, most probable first.
  int path_count_max = 6;
  double look_ahead_m = 1.2;
  /// Constant velocity rules for so long at first.
  double blend_s = 1.2;
  /// Kept from obstacles wherever corners are cut; links are taken to keep it themselves.
  double clearance_m_min = 0.25;
  double sigma_m_s = 0.25;
  double decay = 0.4;
  /// Futures that are never further apart than this are one.
  double merge_m = 0.5;
  /// Someone slower than this stands, and stays: where they turn to is not known yet.
  double standing_m_s = 0.1;
  /// Who is further than this from every place and link is not on the graph.
  double attach_m_max = 1.0;
};

/// A graph, its goals and the ways between them, computed once and asked for everybody.
///
/// Threads: not changed after construction, so any number may read. Cost: goals * (links log
/// places) once, 12 bytes a goal and place.
class GoalField {
 public:
  /// Requires: links and goals name places; clearances and priors finite and not negative.
  GoalField(WalkGraph graph, std::vector<Goal> goals);

  const WalkGraph& graph() const { return graph_; }
  const std::vector<Goal>& goals() const { return goals_; }
  /// The way over links; infinite when there is none.
  double DistanceM(int goal, int place) const;
  /// The next place on the way; -1 at the goal and where there is no way.
  int NextPlace(int goal, int place) const;

 private:
  WalkGraph graph_;
  std::vector<Goal> goals_;
  std::vector<double> distance_m_;
  std::vector<int> next_place_;
};

/// The probability of each goal of the field, by the rule below; they sum to one, or are all zero
/// when no goal can be reached from the path.
std::vector<double> GoalProbabilities(const std::vector<PathPoint>& path, const GoalField& field,
                                      const GoalOptions& options);

/// Walks on the graph to the most likely goals; paths stay on links, hence out of walls.
///
/// Probability of a goal: prior * exp(-(way walked + way left - way at first) / detour), ways on
/// the graph, scaled to sum to one. Goals that lead the same way until the last time asked for are
/// one future with the sum of their probabilities; what is missing to one went to futures beyond
/// `path_count_max` and to goals of less than 0.1 %. From the last point to the graph the way goes
/// straight to a place within whose clearance the point lies; only where there is none, to the
/// nearest link, which nothing proves to be on this side of a wall.
/// Without places near the path: constant velocity alone. Near places but without a way to any
/// goal: constant velocity that waits where it leaves their clearances.
/// Requires: as PredictConstantVelocity; `clearance_m_min` at least 0.05.
std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const GoalField& field,
                                          const GoalOptions& options);

/// The same for a graph that is asked once.
std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const WalkGraph& graph,
                                          const std::vector<Goal>& goals,
                                          const GoalOptions& options);

}  // namespace dsg::query
