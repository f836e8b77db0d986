// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "query/prediction/path_check.h"
#include "query/prediction/prediction.h"
#include "query/prediction/route.h"
#include "query/prediction/route_walk.h"
#include "schema/base/check.h"

namespace dsg::query {
namespace {

/// People do not run faster than detections that jump; Rosinol et al. 2020 use the same bound.
constexpr double kSpeedMaxMS = 3.0;
constexpr double kProbabilityMin = 1e-3;
constexpr double kEdgeStepM = 0.1;
/// Goals that are walked to before merging, per future that is asked for.
constexpr int kGoalsPerPath = 6;

void CheckOptions(const GoalOptions& options) {
  DSG_CHECK(options.detour_m > 0.0 && std::isfinite(options.detour_m));
  DSG_CHECK(options.path_count_max >= 1);
  DSG_CHECK(options.look_ahead_m > 0.0 && std::isfinite(options.look_ahead_m));
  DSG_CHECK(options.blend_s >= 0.0 && std::isfinite(options.blend_s));
  DSG_CHECK(options.clearance_m_min >= 0.05 && std::isfinite(options.clearance_m_min));
  DSG_CHECK(options.sigma_m_s >= 0.0 && std::isfinite(options.sigma_m_s));
  DSG_CHECK(options.merge_m >= 0.0 && options.standing_m_s > 0.0 && options.attach_m_max >= 0.0);
}

/// Someone may have walked where the graph has a gap.
bool ShareAGoal(const std::vector<Attachment>& first, const std::vector<Attachment>& last,
                const GoalField& field) {
  double way_m = 0.0;
  for (size_t i = 0; i < field.goals().size(); ++i) {
    const int goal = static_cast<int>(i);
    if (BestAttachment(first, field, goal, &way_m) >= 0 &&
        BestAttachment(last, field, goal, &way_m) >= 0) {
      return true;
    }
  }
  return false;
}

/// Of the first point that is near the graph, on the same part of it as the last one.
std::vector<Attachment> AttachFirst(const std::vector<PathPoint>& path,
                                    const std::vector<Attachment>& last, const GoalField& field,
                                    const GoalOptions& options) {
  for (const PathPoint& point : path) {
    std::vector<Attachment> found = Attach(point.position_map, field.graph(), options);
    if (ShareAGoal(found, last, field)) return found;
  }
  return last;
}

/// `last` and `first` are the ways onto the graph at both ends of the path.
std::vector<double> Probabilities(const std::vector<Attachment>& first,
                                  const std::vector<Attachment>& last, const GoalField& field,
                                  const GoalOptions& options) {
  // The way walked is the same for all goals, so it falls out of the scaled probabilities.
  const size_t goal_count = field.goals().size();
  std::vector<double> logs(goal_count, -std::numeric_limits<double>::infinity());
  double largest = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < goal_count; ++i) {
    double way_at_first_m = 0.0;
    double way_left_m = 0.0;
    const int goal = static_cast<int>(i);
    if (field.goals()[i].prior == 0.0) continue;
    if (BestAttachment(last, field, goal, &way_left_m) < 0) continue;
    if (BestAttachment(first, field, goal, &way_at_first_m) < 0) continue;
    logs[i] = std::log(field.goals()[i].prior) - (way_left_m - way_at_first_m) / options.detour_m;
    largest = std::max(largest, logs[i]);
  }
  std::vector<double> probabilities(goal_count, 0.0);
  if (std::isinf(largest)) return probabilities;
  for (size_t i = 0; i < goal_count; ++i) probabilities[i] = std::exp(logs[i] - largest);
  const double sum = std::accumulate(probabilities.begin(), probabilities.end(), 0.0);
  for (double& probability : probabilities) probability /= sum;
  return probabilities;
}

/// Goals worth walking to, most probable first.
std::vector<int> LikelyGoals(const std::vector<double>& probabilities, const GoalOptions& options) {
  std::vector<int> goals;
  for (size_t i = 0; i < probabilities.size(); ++i) {
    if (probabilities[i] >= kProbabilityMin) goals.push_back(static_cast<int>(i));
  }
  std::stable_sort(goals.begin(), goals.end(),
                   [&probabilities](int a, int b) { return probabilities[a] > probabilities[b]; });
  const size_t count_max = static_cast<size_t>(options.path_count_max) * kGoalsPerPath;
  if (goals.size() > count_max) goals.resize(count_max);
  return goals;
}

bool AreAlike(const PredictedPath& a, const PredictedPath& b, double merge_m) {
  for (size_t i = 0; i < a.positions_map.size(); ++i) {
    if ((a.positions_map[i] - b.positions_map[i]).norm() > merge_m) return false;
  }
  return true;
}

void MergeIn(PredictedPath path, double merge_m, std::vector<PredictedPath>* paths) {
  for (PredictedPath& other : *paths) {
    if (!AreAlike(path, other, merge_m)) continue;
    other.probability += path.probability;
    return;
  }
  paths->push_back(std::move(path));
}

Eigen::Vector3d WalkingVelocity(const std::vector<PathPoint>& path, const GoalOptions& options) {
  Eigen::Vector3d velocity_map = SmoothedVelocity(path, options.decay).velocity_map;
  // Torsos bob; the graph says where floors rise.
  velocity_map.z() = 0.0;
  const double speed_m_s = velocity_map.norm();
  if (speed_m_s > kSpeedMaxMS) velocity_map *= kSpeedMaxMS / speed_m_s;
  return velocity_map;
}

/// Requires: a goal that can be reached from one of the attachments of the last point.
PredictedPath WalkToGoal(const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns,
                         const std::vector<Attachment>& last, const GoalField& field, int goal,
                         const GoalOptions& options) {
  PredictedPath predicted;
  std::vector<double> seconds;
  for (const TimeNs time_ns : at_ns) {
    seconds.push_back(SecondsAhead(path, time_ns));
    predicted.sigma_m.push_back(options.sigma_m_s * seconds.back());
  }
  const Eigen::Vector3d velocity_map = WalkingVelocity(path, options);
  const double walked_m = seconds.empty() ? 0.0 : seconds.back() * velocity_map.norm();
  // The look-ahead needs some way beyond the last time.
  const double length_m_max = walked_m + 2.0 * options.look_ahead_m;
  double way_m = 0.0;
  const int best = BestAttachment(last, field, goal, &way_m);
  const Route route = BuildRoute(path.back().position_map, last[best], field, goal, length_m_max);
  predicted.positions_map = WalkRoute(route, velocity_map, seconds, options);
  return predicted;
}

PredictedPath ConstantVelocityAlone(const std::vector<PathPoint>& path,
                                    const std::vector<TimeNs>& at_ns, const GoalOptions& options,
                                    bool stands) {
  ConstantVelocityOptions constant;
  constant.decay = options.decay;
  constant.damping = stands ? 0.0 : 1.0;
  constant.sigma_m_s = options.sigma_m_s;
  return PredictConstantVelocity(path, at_ns, constant);
}

/// Whether one ball of clearance holds both points, so that the line between is free.
bool InOneClearance(const Eigen::Vector3d& a_map, const Eigen::Vector3d& b_map,
                    const WalkGraph& graph) {
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    const Eigen::Vector2d place = graph.places_map[i].head<2>();
    if (std::abs(graph.places_map[i].z() - a_map.z()) <= kStoreyHeightM &&
        (a_map.head<2>() - place).norm() <= graph.clearance_m[i] &&
        (b_map.head<2>() - place).norm() <= graph.clearance_m[i]) {
      return true;
    }
  }
  return false;
}

/// How far towards `to_map` all is known to be free.
Eigen::Vector3d LastFree(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                         const WalkGraph& graph) {
  const Eigen::Vector3d way = to_map - from_map;
  const int part_count = 1 + static_cast<int>(std::min(way.norm() / kEdgeStepM, 1e6));
  Eigen::Vector3d reached_map = from_map;
  for (int part = 1; part <= part_count; ++part) {
    const Eigen::Vector3d next_map =
        part == part_count ? to_map : (from_map + way * part / part_count).eval();
    if (!InOneClearance(reached_map, next_map, graph)) break;
    reached_map = next_map;
  }
  return reached_map;
}

/// Waits where the walk leaves what is known to be free.
void WaitAtTheEdge(const PathPoint& last, const WalkGraph& graph, PredictedPath* predicted) {
  Eigen::Vector3d reached_map = last.position_map;
  bool waits = false;
  for (Eigen::Vector3d& position_map : predicted->positions_map) {
    if (!waits) reached_map = LastFree(reached_map, position_map, graph);
    waits = waits || reached_map != position_map;
    position_map = reached_map;
  }
}

}  // namespace

std::vector<double> GoalProbabilities(const std::vector<PathPoint>& path, const GoalField& field,
                                      const GoalOptions& options) {
  CheckOptions(options);
  CheckPathAndTimes(path, {});
  const std::vector<Attachment> last = Attach(path.back().position_map, field.graph(), options);
  return Probabilities(AttachFirst(path, last, field, options), last, field, options);
}

std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const GoalField& field,
                                          const GoalOptions& options) {
  CheckOptions(options);
  CheckPathAndTimes(path, at_ns);
  if (WalkingVelocity(path, options).norm() < options.standing_m_s) {
    return {ConstantVelocityAlone(path, at_ns, options, true)};
  }
  const std::vector<Attachment> last = Attach(path.back().position_map, field.graph(), options);
  const std::vector<double> probabilities =
      Probabilities(AttachFirst(path, last, field, options), last, field, options);

  std::vector<PredictedPath> paths;
  for (const int goal : LikelyGoals(probabilities, options)) {
    PredictedPath predicted = WalkToGoal(path, at_ns, last, field, goal, options);
    predicted.probability = probabilities[goal];
    MergeIn(std::move(predicted), options.merge_m, &paths);
  }
  if (paths.empty()) {
    PredictedPath alone = ConstantVelocityAlone(path, at_ns, options, false);
    // Far from the graph nothing is known of walls, near it a good deal.
    if (!last.empty()) WaitAtTheEdge(path.back(), field.graph(), &alone);
    return {alone};
  }
  std::stable_sort(paths.begin(), paths.end(), [](const PredictedPath& a, const PredictedPath& b) {
    return a.probability > b.probability;
  });
  if (paths.size() > static_cast<size_t>(options.path_count_max)) {
    paths.resize(options.path_count_max);
  }
  return paths;
}

std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const WalkGraph& graph,
                                          const std::vector<Goal>& goals,
                                          const GoalOptions& options) {
  return PredictToGoals(path, at_ns, GoalField(graph, goals), options);
}

}  // namespace dsg::query
