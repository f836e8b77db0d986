// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/goal_prediction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "query/prediction/route.h"
#include "query/prediction/velocity.h"
#include "query/prediction/ways.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

/// Links between two questions to the stop check.
constexpr int64_t kLinksPerStop = 4096;

bool IsPlace(int place, const WalkGraph& graph) {
  return place >= 0 && static_cast<size_t>(place) < graph.places_map.size();
}

void CheckGraph(const WalkGraph& graph) {
  DSG_CHECK(graph.clearance_m.size() == graph.places_map.size());
  DSG_CHECK(graph.link_clearance_m.empty() || graph.link_clearance_m.size() == graph.links.size());
  for (const Eigen::Vector3d& place_map : graph.places_map) DSG_CHECK(place_map.allFinite());
  for (const double clearance_m : graph.clearance_m) {
    DSG_CHECK(clearance_m >= 0.0 && std::isfinite(clearance_m));
  }
  for (const double clearance_m : graph.link_clearance_m) DSG_CHECK(clearance_m >= 0.0);
  for (const auto& [a, b] : graph.links) DSG_CHECK(IsPlace(a, graph) && IsPlace(b, graph));
}

void CheckGoals(const std::vector<Goal>& goals, const WalkGraph& graph) {
  for (const Goal& goal : goals) {
    DSG_CHECK(IsPlace(goal.place, graph));
    DSG_CHECK(goal.prior >= 0.0 && std::isfinite(goal.prior));
  }
}

}  // namespace

absl::StatusOr<GoalField> GoalField::Make(WalkGraph graph, std::vector<Goal> goals,
                                          const StopCheck& stop) {
  CheckGraph(graph);
  CheckGoals(goals, graph);
  DSG_ASSIGN_OR_RETURN(FreeSpace free_space, FreeSpace::Make(graph, stop));
  DSG_ASSIGN_OR_RETURN(WalkIndex index, WalkIndex::Make(graph, stop));
  const auto ground = std::make_shared<Ground>(
      Ground{std::move(graph), std::move(free_space), std::move(index), {}, {}});
  const std::vector<Eigen::Vector3d>& places_map = ground->graph.places_map;
  std::vector<size_t>& offsets = ground->offsets;
  offsets.assign(places_map.size() + 1, 0);
  for (const auto& [a, b] : ground->graph.links) {
    ++offsets[a + 1];
    ++offsets[b + 1];
  }
  for (size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  ground->neighbours.resize(offsets.back());
  std::vector<size_t> next(offsets.begin(), offsets.end() - 1);
  StopCounter counter(stop, kLinksPerStop);
  for (const auto& [a, b] : ground->graph.links) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const double way_m = (places_map[a] - places_map[b]).norm();
    ground->neighbours[next[a]++] = {b, way_m};
    ground->neighbours[next[b]++] = {a, way_m};
  }
  GoalField field;
  field.ground_ = ground;
  field.goals_ = std::move(goals);
  return field;
}

GoalField::GoalField(WalkGraph graph, std::vector<Goal> goals)
    : GoalField(*Make(std::move(graph), std::move(goals), StopCheck())) {}

GoalField GoalField::WithGoals(std::vector<Goal> goals) const {
  CheckGoals(goals, graph());
  GoalField field;
  field.ground_ = ground_;
  field.goals_ = std::move(goals);
  return field;
}

size_t GoalField::memory_bytes() const {
  const WalkGraph& walk = graph();
  return sizeof(Ground) + goals_.capacity() * sizeof(Goal) + free_space().memory_bytes() +
         index().memory_bytes() + walk.places_map.capacity() * sizeof(Eigen::Vector3d) +
         (walk.clearance_m.capacity() + walk.link_clearance_m.capacity()) * sizeof(double) +
         walk.links.capacity() * sizeof(std::pair<int, int>) +
         ground_->offsets.capacity() * sizeof(size_t) +
         ground_->neighbours.capacity() * sizeof(Neighbour);
}

namespace {

/// Instants at which two futures are compared.
constexpr size_t kComparedCount = 6;

/// How far apart two futures ever are.
double ApartM(const PredictedPath& a, const PredictedPath& b) {
  const size_t count = a.positions_map.size();
  const size_t step = 1 + (count - std::min(count, size_t{1})) / kComparedCount;
  double apart_m = 0.0;
  for (size_t back = 0; back < count; back += step) {
    const size_t i = count - 1 - back;
    apart_m = std::max(apart_m, (a.positions_map[i] - b.positions_map[i]).norm());
  }
  return apart_m;
}

/// How much probability is around a future, by how near the others are.
double WeightAround(size_t i, const std::vector<size_t>& others,
                    const std::vector<PredictedPath>& paths, const Eigen::MatrixXd& apart_m,
                    double merge_m) {
  const Eigen::Index row = static_cast<Eigen::Index>(i);
  double weight = 0.0;
  for (const size_t j : others) {
    const double way_m = apart_m(row, static_cast<Eigen::Index>(j));
    if (way_m < merge_m) weight += paths[j].probability * (1.0 - way_m / merge_m);
  }
  return weight;
}

// Futures within `merge_m` of the best one go into it, then the same with the rest. The best one
// has most probability around it, so that of many goals that lead much the same way the middle one
// stays. In the order in which they were found.
// Requires: all at the same times. Cost: square of the number of futures.
std::vector<PredictedPath> Merged(const std::vector<PredictedPath>& paths, double merge_m) {
  const Eigen::Index count = static_cast<Eigen::Index>(paths.size());
  Eigen::MatrixXd apart_m = Eigen::MatrixXd::Zero(count, count);
  for (size_t i = 0; i < paths.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double way_m = ApartM(paths[i], paths[j]);
      apart_m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = way_m;
      apart_m(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = way_m;
    }
  }
  std::vector<size_t> left(paths.size());
  std::iota(left.begin(), left.end(), size_t{0});
  std::vector<PredictedPath> merged;
  while (!left.empty()) {
    size_t best = left.front();
    double best_weight = -1.0;
    for (const size_t i : left) {
      const double weight = WeightAround(i, left, paths, apart_m, merge_m);
      if (weight <= best_weight) continue;
      best_weight = weight;
      best = i;
    }
    merged.push_back(paths[best]);
    merged.back().probability = 0.0;
    std::erase_if(left, [&](size_t i) {
      const double way_m = apart_m(static_cast<Eigen::Index>(best), static_cast<Eigen::Index>(i));
      if (i != best && way_m > merge_m) return false;
      merged.back().probability += paths[i].probability;
      return true;
    });
  }
  return merged;
}

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

namespace {

constexpr double kEdgeStepM = 0.1;

struct Ball {
  Eigen::Vector2d centre;
  double radius_m = 0.0;
};

/// Clearances of the storey that reach into what the path covers.
std::vector<Ball> BallsAround(const PathPoint& last, const PredictedPath& predicted,
                              const WalkGraph& graph) {
  Eigen::AlignedBox2d covered(last.position_map.head<2>().eval());
  for (const Eigen::Vector3d& position_map : predicted.positions_map) {
    covered.extend(position_map.head<2>().eval());
  }
  std::vector<Ball> balls;
  for (size_t i = 0; i < graph.places_map.size(); ++i) {
    const Eigen::Vector2d centre = graph.places_map[i].head<2>();
    if (std::abs(graph.places_map[i].z() - last.position_map.z()) > kStoreyHeightM) continue;
    if (covered.exteriorDistance(centre) > graph.clearance_m[i]) continue;
    balls.push_back({centre, graph.clearance_m[i]});
  }
  return balls;
}

/// Whether one ball holds both points, so that the line between is free.
bool InOneBall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::vector<Ball>& balls) {
  return std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
    return (a - ball.centre).norm() <= ball.radius_m && (b - ball.centre).norm() <= ball.radius_m;
  });
}

/// How far towards `to_map` all is known to be free.
absl::StatusOr<Eigen::Vector3d> LastFree(const Eigen::Vector3d& from_map,
                                         const Eigen::Vector3d& to_map,
                                         const std::vector<Ball>& balls, const StopCheck& stop) {
  const Eigen::Vector3d way = to_map - from_map;
  const int part_count = 1 + static_cast<int>(std::min(way.norm() / kEdgeStepM, 1e6));
  Eigen::Vector3d reached_map = from_map;
  for (int part = 1; part <= part_count; ++part) {
    const Eigen::Vector3d next_map =
        part == part_count ? to_map : (from_map + way * part / part_count).eval();
    DSG_RETURN_IF_ERROR(AskStop(stop));
    if (!InOneBall(reached_map.head<2>(), next_map.head<2>(), balls)) break;
    reached_map = next_map;
  }
  return reached_map;
}

}  // namespace

absl::Status StopAtEdge(const PathPoint& last, const WalkGraph& graph, const StopCheck& stop,
                        PredictedPath* predicted) {
  const std::vector<Ball> balls = BallsAround(last, *predicted, graph);
  Eigen::Vector3d reached_map = last.position_map;
  bool waits = false;
  for (Eigen::Vector3d& position_map : predicted->positions_map) {
    if (!waits) {
      DSG_ASSIGN_OR_RETURN(reached_map, LastFree(reached_map, position_map, balls, stop));
    }
    waits = waits || reached_map != position_map;
    position_map = reached_map;
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
