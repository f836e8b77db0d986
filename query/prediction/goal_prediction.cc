// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "query/prediction/future_merging.h"
#include "query/prediction/pace.h"
#include "query/prediction/path_check.h"
#include "query/prediction/prediction.h"
#include "query/prediction/route.h"
#include "query/prediction/route_walk.h"
#include "query/prediction/ways.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

/// People do not run faster than detections that jump; Rosinol et al. 2020 use the same bound.
constexpr double kSpeedMaxMS = 3.0;
constexpr double kProbabilityMin = 1e-3;
/// The beginning of a way, whose direction is compared with the velocity.
constexpr double kHeadingM = 1.0;
/// Goals that are looked at more closely.
constexpr size_t kGoalCountMax = 200;

void CheckOptions(const GoalOptions& options) {
  DSG_CHECK(options.detour_m > 0.0 && std::isfinite(options.detour_m));
  DSG_CHECK(options.path_count_max >= 1);
  DSG_CHECK(options.look_ahead_m > 0.0 && std::isfinite(options.look_ahead_m));
  DSG_CHECK(options.blend_s >= 0.0 && std::isfinite(options.blend_s));
  DSG_CHECK(options.clearance_m_min >= 0.05 && std::isfinite(options.clearance_m_min));
  DSG_CHECK(options.sigma_m_s >= 0.0 && std::isfinite(options.sigma_m_s));
  DSG_CHECK(options.way_m_max >= 0.0);
  DSG_CHECK(options.heading >= 0.0 && std::isfinite(options.heading));
  DSG_CHECK(options.straight_m_min >= 0.1 && std::isfinite(options.straight_m_min));
  DSG_CHECK(options.walking_m_s >= 0.0 && options.walking_m_s <= kSpeedMaxMS);
  DSG_CHECK(options.pace_change_m_s_min > 0.0);
  DSG_CHECK(options.merge_m > 0.0 && options.standing_m_s > 0.0 && options.attach_m_max >= 0.0);
}

/// The ways from the last point.
struct Departure {
  std::vector<Attachment> attachments;
  Ways ways;
};

absl::StatusOr<Departure> Depart(const std::vector<PathPoint>& path, const GoalField& field,
                                 const GoalOptions& options, const StopCheck& stop) {
  std::vector<Attachment> attachments = Attach(path.back().position_map, field, options);
  DSG_ASSIGN_OR_RETURN(Ways ways, Ways::Find(attachments, field, options.way_m_max, stop));
  return Departure{std::move(attachments), std::move(ways)};
}

/// From the first point that is near the graph, on the same part of it as the last one: someone may
/// have walked where the graph has a gap. Knows the ways to the goals that `last` reaches.
absl::StatusOr<Ways> WaysFromFirst(const std::vector<PathPoint>& path, const Ways& last,
                                   const GoalField& field, const GoalOptions& options,
                                   const StopCheck& stop) {
  std::vector<int> wanted;
  for (const Goal& goal : field.goals()) {
    if (last.Reaches(goal.place)) wanted.push_back(goal.place);
  }
  if (wanted.empty()) return last;
  for (const PathPoint& point : path) {
    const std::vector<Attachment> found = Attach(point.position_map, field, options);
    if (found.empty()) continue;
    DSG_ASSIGN_OR_RETURN(Ways ways,
                         Ways::FindThese(found, field, 2.0 * options.way_m_max, wanted, stop));
    const bool share_a_goal =
        std::any_of(wanted.begin(), wanted.end(), [&](int place) { return ways.Reaches(place); });
    if (share_a_goal) return ways;
  }
  return last;
}

/// From the ways from both ends of the path.
std::vector<double> Probabilities(const Ways& first, const Ways& last, const GoalField& field,
                                  const GoalOptions& options) {
  // The way walked is the same for all goals, so it falls out of the scaled probabilities.
  const size_t goal_count = field.goals().size();
  std::vector<double> logs(goal_count, -std::numeric_limits<double>::infinity());
  double largest = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < goal_count; ++i) {
    const Goal& goal = field.goals()[i];
    if (goal.prior == 0.0 || !last.Reaches(goal.place) || !first.Reaches(goal.place)) continue;
    logs[i] =
        std::log(goal.prior) - (last.WayM(goal.place) - first.WayM(goal.place)) / options.detour_m;
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
std::vector<int> LikelyGoals(const std::vector<double>& probabilities) {
  std::vector<int> goals;
  for (size_t i = 0; i < probabilities.size(); ++i) {
    if (probabilities[i] >= kProbabilityMin) goals.push_back(static_cast<int>(i));
  }
  std::stable_sort(goals.begin(), goals.end(),
                   [&probabilities](int a, int b) { return probabilities[a] > probabilities[b]; });
  if (goals.size() > kGoalCountMax) goals.resize(kGoalCountMax);
  return goals;
}

Eigen::Vector3d WalkingVelocity(const std::vector<PathPoint>& path, const GoalOptions& options) {
  Eigen::Vector3d velocity_map = SmoothedVelocity(path, options.decay).velocity_map;
  // Torsos bob; the graph says where floors rise.
  velocity_map.z() = 0.0;
  const double speed_m_s = velocity_map.norm();
  if (speed_m_s > kSpeedMaxMS) velocity_map *= kSpeedMaxMS / speed_m_s;
  return velocity_map;
}

struct Candidate {
  int goal = 0;
  double probability = 0.0;
  Route route;
};

/// How likely people set out along a route, from which way they are going already.
double HeadingFactor(const Route& route, const Eigen::Vector3d& velocity_map,
                     const GoalOptions& options) {
  size_t segment = 0;
  const Eigen::Vector2d ahead =
      (route.At(kHeadingM, &segment) - route.points_map.front()).head<2>();
  const Eigen::Vector2d own = velocity_map.head<2>();
  const double norms = ahead.norm() * own.norm();
  // At the goal already: neither towards it nor away.
  const double cosine = norms > 0.0 ? ahead.dot(own) / norms : 0.0;
  return std::exp(options.heading * (cosine - 1.0));
}

/// Keeps the sum of the probabilities.
void WeighHeadings(const Eigen::Vector3d& velocity_map, const GoalOptions& options,
                   std::vector<Candidate>* candidates) {
  double before = 0.0;
  double after = 0.0;
  for (Candidate& candidate : *candidates) {
    before += candidate.probability;
    candidate.probability *= HeadingFactor(candidate.route, velocity_map, options);
    after += candidate.probability;
  }
  for (Candidate& candidate : *candidates) candidate.probability *= before / after;
}

/// The ways to the likely goals, those that begin alike as one, most probable first.
absl::StatusOr<std::vector<Candidate>> Candidates(const std::vector<double>& probabilities,
                                                  const std::vector<PathPoint>& path,
                                                  const Departure& from, const GoalField& field,
                                                  double length_m_max, const GoalOptions& options,
                                                  const StopCheck& stop) {
  // By the attachment and the places up to that length.
  std::map<std::pair<int, std::vector<int>>, size_t> known;
  std::vector<Candidate> candidates;
  for (const int goal : LikelyGoals(probabilities)) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const int place = field.goals()[goal].place;
    const int origin = from.ways.Origin(place);
    std::vector<int> places = from.ways.PlacesWithin(place, length_m_max);
    const auto [at, is_new] = known.emplace(std::pair(origin, places), candidates.size());
    if (!is_new) {
      candidates[at->second].probability += probabilities[goal];
      continue;
    }
    const Route route = BuildRoute(path.back().position_map, from.attachments[origin], places,
                                   field.graph(), length_m_max);
    candidates.push_back({goal, probabilities[goal],
                          Straightened(route, field.free_space(), options.straight_m_min)});
  }
  WeighHeadings(WalkingVelocity(path, options), options, &candidates);
  return candidates;
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

}  // namespace

std::vector<double> GoalProbabilities(const std::vector<PathPoint>& path, const GoalField& field,
                                      const GoalOptions& options) {
  CheckOptions(options);
  CheckPathAndTimes(path, {});
  const Departure last = *Depart(path, field, options, StopCheck());
  const Ways first = *WaysFromFirst(path, last.ways, field, options, StopCheck());
  return Probabilities(first, last.ways, field, options);
}

absl::StatusOr<std::vector<PredictedPath>> PredictToGoals(const std::vector<PathPoint>& path,
                                                          const std::vector<TimeNs>& at_ns,
                                                          const GoalField& field,
                                                          const GoalOptions& options,
                                                          const StopCheck& stop) {
  CheckOptions(options);
  CheckPathAndTimes(path, at_ns);
  if (WalkingVelocity(path, options).norm() < options.standing_m_s) {
    return std::vector<PredictedPath>{ConstantVelocityAlone(path, at_ns, options, true)};
  }
  DSG_ASSIGN_OR_RETURN(const Departure from, Depart(path, field, options, stop));
  DSG_ASSIGN_OR_RETURN(const Ways first, WaysFromFirst(path, from.ways, field, options, stop));
  const std::vector<double> probabilities = Probabilities(first, from.ways, field, options);

  const Eigen::Vector3d velocity_map = WalkingVelocity(path, options);
  const Pace pace = PaceOf(path, velocity_map.norm(), options);
  std::vector<double> seconds;
  std::vector<double> sigma_m;
  for (const TimeNs time_ns : at_ns) {
    seconds.push_back(SecondsAhead(path, time_ns));
    sigma_m.push_back(options.sigma_m_s * seconds.back());
  }
  // The look-ahead needs some way beyond the last time.
  const double length_m_max =
      (seconds.empty() ? 0.0 : pace.WayM(seconds.back())) + 2.0 * options.look_ahead_m;
  DSG_ASSIGN_OR_RETURN(const std::vector<Candidate> candidates,
                       Candidates(probabilities, path, from, field, length_m_max, options, stop));
  std::vector<PredictedPath> paths;
  for (const Candidate& candidate : candidates) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    PredictedPath predicted{
        candidate.probability,
        WalkRoute(candidate.route, velocity_map.normalized(), pace, seconds, options), sigma_m,
        candidate.goal};
    paths.push_back(std::move(predicted));
  }
  paths = Merged(paths, options.merge_m);
  if (paths.empty()) {
    PredictedPath alone = ConstantVelocityAlone(path, at_ns, options, false);
    // Far from the graph nothing is known of walls, near it a good deal.
    if (!from.attachments.empty()) {
      DSG_RETURN_IF_ERROR(StopAtEdge(path.back(), field.graph(), stop, &alone));
    }
    return std::vector<PredictedPath>{alone};
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
                                          const std::vector<TimeNs>& at_ns, const GoalField& field,
                                          const GoalOptions& options) {
  return *PredictToGoals(path, at_ns, field, options, StopCheck());
}

std::vector<PredictedPath> PredictToGoals(const std::vector<PathPoint>& path,
                                          const std::vector<TimeNs>& at_ns, const WalkGraph& graph,
                                          const std::vector<Goal>& goals,
                                          const GoalOptions& options) {
  return PredictToGoals(path, at_ns, GoalField(graph, goals), options);
}

}  // namespace dsg::query
